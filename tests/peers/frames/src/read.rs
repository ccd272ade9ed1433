//! The physical limit: every byte under the taxels is read in place, 32 at a time. The only result is a number that
//! depends on all of them.

use wstac_core::layout::Layout;

/// The number of bytes that are read at once.
#[cfg(target_arch = "x86_64")]
const VECTOR: usize = 32;
/// The bytes of a cache line. The next constant is the number of rows ahead whose lines are prefetched, as in wstac.
#[cfg(target_arch = "x86_64")]
const LINE: usize = 64;
#[cfg(target_arch = "x86_64")]
const AHEAD: usize = 8;

/// Returns a number that depends on all bytes under the taxels.
pub fn taxels(frame: &[u8], bytes_per_row: usize, layout: &Layout, pixel: usize, ahead: bool) -> u64 {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the machine has AVX2.
        return unsafe { with_avx2(frame, bytes_per_row, layout, pixel, ahead) };
    }
    any(frame, bytes_per_row, layout, pixel)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn with_avx2(frame: &[u8], bytes_per_row: usize, layout: &Layout, pixel: usize, ahead: bool) -> u64 {
    // These are the row lengths of the paper's layout in 1280 × 720. As constants, they let the compiler unroll the
    // loop.
    match (usize::from(layout.taxel()[0]) * pixel, ahead) {
        (90, false) => rows::<90, 0>(frame, bytes_per_row, layout, pixel),
        (90, true) => rows::<90, AHEAD>(frame, bytes_per_row, layout, pixel),
        (180, false) => rows::<180, 0>(frame, bytes_per_row, layout, pixel),
        (180, true) => rows::<180, AHEAD>(frame, bytes_per_row, layout, pixel),
        _ => any(frame, bytes_per_row, layout, pixel),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn rows<const BYTES: usize, const AHEAD: usize>(
    frame: &[u8],
    bytes_per_row: usize,
    layout: &Layout,
    pixel: usize,
) -> u64 {
    use std::arch::x86_64::{
        _MM_HINT_T0, _mm_prefetch, _mm256_add_epi64, _mm256_loadu_si256, _mm256_setzero_si256, _mm256_storeu_si256,
    };
    // Four sums that do not depend on each other.
    let mut sums = [_mm256_setzero_si256(); 4];
    let height = usize::from(layout.taxel()[1]);
    for [x, y] in layout.corners().map(|corner| corner.map(usize::from)) {
        let block = &frame[y * bytes_per_row + x * pixel..][..(height - 1) * bytes_per_row + BYTES];
        for row in 0..height {
            // SAFETY: the block has as many rows of as many bytes; the last vector ends with the row, and may have
            // bytes of the one before.
            unsafe {
                let row = block.as_ptr().add(row * bytes_per_row);
                if AHEAD > 0 {
                    let ahead = row.wrapping_add(AHEAD * bytes_per_row);
                    for line in (0..BYTES).step_by(LINE).chain([BYTES - 1]) {
                        _mm_prefetch::<_MM_HINT_T0>(ahead.wrapping_add(line).cast());
                    }
                }
                for index in 0..BYTES / VECTOR {
                    let vector = _mm256_loadu_si256(row.add(index * VECTOR).cast());
                    sums[index % 4] = _mm256_add_epi64(sums[index % 4], vector);
                }
                sums[3] = _mm256_add_epi64(sums[3], _mm256_loadu_si256(row.add(BYTES - VECTOR).cast()));
            }
        }
    }
    let mut words = [[0_u64; VECTOR / 8]; 4];
    for (words, sum) in words.iter_mut().zip(sums) {
        // SAFETY: there is room for a vector.
        unsafe { _mm256_storeu_si256(words.as_mut_ptr().cast(), sum) };
    }
    words.as_flattened().iter().fold(0, |all, word| all.wrapping_add(*word))
}

/// Reads on other machines or with other widths, in a loop that the compiler vectorizes as it likes.
fn any(frame: &[u8], bytes_per_row: usize, layout: &Layout, pixel: usize) -> u64 {
    let [width, height] = layout.taxel().map(usize::from);
    let starts = layout.corners().map(|[x, y]| usize::from(y) * bytes_per_row + usize::from(x) * pixel);
    let rows = starts.into_iter().flat_map(|start| (0..height).map(move |row| start + row * bytes_per_row));
    rows.map(|at| {
        let (words, rest) = frame[at..at + width * pixel].as_chunks();
        let words = words.iter().fold(0, |sum: u64, word| sum.wrapping_add(u64::from_le_bytes(*word)));
        rest.iter().fold(words, |sum, byte| sum.wrapping_add(u64::from(*byte)))
    })
    .fold(0, u64::wrapping_add)
}
