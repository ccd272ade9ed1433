//! The physical limit: every byte under the taxels is read where it lies, 32 at a time, and nothing is made of them but a number that needs them all.

use wstac_core::layout::Layout;

/// Bytes that are read at a time.
const VECTOR: usize = 32;

/// A number that all bytes under the taxels make.
pub fn taxels(frame: &[u8], bytes_per_row: usize, layout: &Layout, pixel: usize) -> u64 {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the machine has AVX2.
        return unsafe { with_avx2(frame, bytes_per_row, layout, pixel) };
    }
    any(frame, bytes_per_row, layout, pixel)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn with_avx2(frame: &[u8], bytes_per_row: usize, layout: &Layout, pixel: usize) -> u64 {
    // A taxel's row of the paper's layout in 1280 × 720 has so many bytes: the compiler knows where it ends.
    match usize::from(layout.taxel()[0]) * pixel {
        90 => rows::<90>(frame, bytes_per_row, layout, pixel),
        180 => rows::<180>(frame, bytes_per_row, layout, pixel),
        270 => rows::<270>(frame, bytes_per_row, layout, pixel),
        _ => any(frame, bytes_per_row, layout, pixel),
    }
}

#[inline(always)]
fn rows<const BYTES: usize>(frame: &[u8], bytes_per_row: usize, layout: &Layout, pixel: usize) -> u64 {
    // Four vectors that do not wait for each other.
    let mut sums = [[0_u64; VECTOR / 8]; 4];
    for [x, y] in layout.corners().map(|corner| corner.map(usize::from)) {
        for row in y..y + usize::from(layout.taxel()[1]) {
            let row = &frame[row * bytes_per_row + x * pixel..][..BYTES];
            for (index, vector) in row.as_chunks().0.iter().enumerate() {
                add(&mut sums[index % 4], vector);
            }
            if let Some(vector) = row.last_chunk() {
                add(&mut sums[3], vector);
            }
        }
    }
    sums.as_flattened().iter().fold(0, |all, sum| all.wrapping_add(*sum))
}

#[inline(always)]
fn add(sum: &mut [u64; VECTOR / 8], vector: &[u8; VECTOR]) {
    for (sum, word) in sum.iter_mut().zip(vector.as_chunks().0) {
        *sum = sum.wrapping_add(u64::from_le_bytes(*word));
    }
}

/// Where the machine or the width is another: whatever the compiler makes of it.
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
