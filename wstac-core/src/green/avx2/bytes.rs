//! The sum of one byte a pixel: a mask takes it out, and one instruction adds eight bytes.

use core::arch::x86_64::{__m256i, _mm256_add_epi64, _mm256_and_si256, _mm256_sad_epu8, _mm256_setzero_si256};

use super::{VECTOR, Wide, load, quads, vector};

/// Rows that are summed side by side, so that a row's cache lines are asked for while another's are awaited.
const ROWS: usize = 4;
/// Vectors after which any period repeats.
const MASKS: usize = 3;

/// Which bytes count: those at `PLACE` of every `PERIOD`.
struct Counted<const PERIOD: usize, const PLACE: usize>;

impl<const PERIOD: usize, const PLACE: usize> Counted<PERIOD, PLACE> {
    /// Of vectors whose first byte is at 0, 32 and 64, as all others' of a row are but for multiples of the period.
    const MASKS: [[u8; VECTOR]; MASKS] = {
        let mut masks = [[0; VECTOR]; MASKS];
        let mut at = PLACE;
        while at < VECTOR * MASKS {
            masks[at / VECTOR][at % VECTOR] = u8::MAX;
            at += PERIOD;
        }
        masks
    };
}

/// The sum of the bytes at `PLACE` of every `PERIOD` bytes of rows.
#[target_feature(enable = "avx2")]
pub(super) fn sum<const PERIOD: usize, const PLACE: usize>(wide: Wide<'_>) -> u32 {
    let (before, last, tail) = (wide.before(), wide.last(), wide.tail());
    let block = wide.0;
    let [a, b, c] = const { &Counted::<PERIOD, PLACE>::MASKS };
    let masks = [vector(a), vector(b), vector(c)];
    // A row's end is at a multiple of the period, so its last vector is as one at -32, which is as one at 64.
    let tail = _mm256_and_si256(tail, masks[MASKS - 1]);
    // Where vectors are whole periods, one mask is all there are.
    let mask = |index: usize| if VECTOR.is_multiple_of(PERIOD) { masks[0] } else { masks[index % MASKS] };
    let mut sums = [_mm256_setzero_si256(); ROWS];
    let mut row = block.bytes().as_ptr();
    for _ in 0..block.rows() / ROWS {
        let starts: [_; ROWS] = core::array::from_fn(|index| row.wrapping_add(index * block.bytes_per_row()));
        for index in 0..before {
            let mask = mask(index);
            for (sum, start) in sums.iter_mut().zip(starts) {
                // SAFETY: a block has as many rows, each with whole vectors up to there.
                *sum = add(*sum, unsafe { load(start.wrapping_add(VECTOR * index)) }, mask);
            }
        }
        for (sum, start) in sums.iter_mut().zip(starts) {
            // SAFETY: these are the last bytes of each row, which is a vector wide at least.
            *sum = add(*sum, unsafe { load(start.wrapping_add(last)) }, tail);
        }
        row = row.wrapping_add(ROWS * block.bytes_per_row());
    }
    for _ in 0..block.rows() % ROWS {
        for index in 0..before {
            // SAFETY: as above.
            sums[0] = add(sums[0], unsafe { load(row.wrapping_add(VECTOR * index)) }, mask(index));
        }
        // SAFETY: as above.
        sums[0] = add(sums[0], unsafe { load(row.wrapping_add(last)) }, tail);
        row = row.wrapping_add(block.bytes_per_row());
    }
    let [a, b, c, d] = sums;
    let all = _mm256_add_epi64(_mm256_add_epi64(a, b), _mm256_add_epi64(c, d));
    quads(all).iter().sum::<u64>() as u32
}

#[inline]
#[target_feature(enable = "avx2")]
fn add(sum: __m256i, bytes: __m256i, mask: __m256i) -> __m256i {
    _mm256_add_epi64(sum, _mm256_sad_epu8(_mm256_and_si256(bytes, mask), _mm256_setzero_si256()))
}
