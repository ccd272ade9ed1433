//! Reasons and kinds of faults of a recording, kept as long as the program runs: a few words, the same again and again.

/// Most different words of a recording.
const MOST: usize = 64;

/// Words that are kept.
#[derive(Clone, Debug, Default)]
pub(super) struct Words(Vec<&'static str>);

impl Words {
    /// A word for good. A file with more of them than any recording has gets one for all the rest.
    pub(super) fn keep(&mut self, word: &str) -> &'static str {
        if let Some(kept) = self.0.iter().find(|kept| **kept == word) {
            return kept;
        }
        if self.0.len() >= MOST {
            return "other";
        }
        let kept: &'static str = Box::leak(word.into());
        self.0.push(kept);
        kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_kept_once_and_not_without_end() {
        let mut words = Words::default();
        assert!(std::ptr::eq(words.keep("slow"), words.keep(&String::from("slow"))));
        for k in 1..MOST {
            assert_eq!(words.keep(&k.to_string()), k.to_string());
        }
        assert_eq!((words.keep("one too many"), words.keep("slow"), words.0.len()), ("other", "slow", MOST));
    }
}
