//! Four bytes a word, in any core's instructions: the words themselves are added up, and every second byte of them in two lanes of 16
//! bits; what the total has more are the other bytes, in lanes too.
#![allow(unsafe_code)]

use super::of_run;
use crate::frame::Block;

/// Every second byte of a word.
const LANES: u32 = 0x00FF_00FF;
/// Words whose bytes' sums fit a lane: 257 of them just do.
const MOST_WORDS: usize = 256;
/// Words that are written out, for fewer turns of the loop.
const GROUP: usize = 4;

/// As [`super::plain`].
#[inline(always)]
pub(in super::super) fn sum(block: Block<'_>) -> u32 {
    let mut lanes = Lanes::default();
    block.each_row().map(|run| lanes.add(run)).sum::<u32>() + lanes.take()
}

/// Sums of words that have not been told apart.
#[derive(Default)]
struct Lanes {
    total: u32,
    odd: u32,
    words: usize,
}

impl Lanes {
    /// Adds the words of a run; the sum of what could not be added.
    #[inline(always)]
    fn add(&mut self, run: &[u8]) -> u32 {
        // SAFETY: four bytes of any kind are a word.
        let (head, words, tail) = unsafe { run.align_to::<u32>() };
        let mut sum = of_run(head) + of_run(tail);
        for words in words.chunks(MOST_WORDS) {
            if self.words + words.len() > MOST_WORDS {
                sum += self.take();
            }
            self.words += words.len();
            let (groups, left) = words.as_chunks::<GROUP>();
            for group in groups {
                for &word in group {
                    self.add_word(word);
                }
            }
            for &word in left {
                self.add_word(word);
            }
        }
        sum
    }

    #[inline(always)]
    fn add_word(&mut self, word: u32) {
        self.total = self.total.wrapping_add(word);
        self.odd += (word >> 8) & LANES;
    }

    /// The sum of the bytes; none are left. No carry of the total is missed: without the odd bytes it is below 2^32.
    #[inline(always)]
    fn take(&mut self) -> u32 {
        let Self { total, odd, .. } = core::mem::take(self);
        let even = total.wrapping_sub(odd << 8);
        (even & 0xFFFF) + (even >> 16) + (odd & 0xFFFF) + (odd >> 16)
    }
}
