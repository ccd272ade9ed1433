//! Reasons and kinds of faults of recordings, kept as long as the program runs: a few words, the same again and again.

use std::sync::{Mutex, PoisonError};

/// Most different words, of all recordings together.
const MOST: usize = 1024;
/// Most bytes of a word; those of this program have less than half as many.
const LONGEST: usize = 200;

/// Words that are kept: once each, however many recordings are opened.
static WORDS: Mutex<Vec<&'static str>> = Mutex::new(Vec::new());

/// A word for good. Where there are more of them than recordings have, all the rest are one.
pub(super) fn keep(word: &str) -> &'static str {
    keep_in(&mut WORDS.lock().unwrap_or_else(PoisonError::into_inner), word)
}

fn keep_in(words: &mut Vec<&'static str>, word: &str) -> &'static str {
    if let Some(kept) = words.iter().find(|kept| **kept == word) {
        return kept;
    }
    if words.len() >= MOST || word.len() > LONGEST {
        return "other";
    }
    let kept: &'static str = Box::leak(word.into());
    words.push(kept);
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_kept_once_and_not_without_end() {
        let mut words = Vec::new();
        assert!(std::ptr::eq(keep_in(&mut words, "slow"), keep_in(&mut words, &String::from("slow"))));
        for k in 1..MOST {
            assert_eq!(keep_in(&mut words, &k.to_string()), k.to_string());
        }
        assert_eq!((keep_in(&mut words, "one too many"), keep_in(&mut words, "slow")), ("other", "slow"));
        assert_eq!((words.len(), keep(&"x".repeat(LONGEST + 1))), (MOST, "other"));
        assert!(std::ptr::eq(keep("slow"), keep("slow")));
    }
}
