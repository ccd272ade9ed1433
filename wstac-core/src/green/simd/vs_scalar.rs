//! Compares blocks of every format that has vector kernels with the plain code, run by run.

use std::format;
use std::vec::Vec;

use super::tests::{Chance, with_each_set};
use crate::frame::{Rows, Run, Stride};
use crate::green::GreenChannel;
use crate::green::gray::Gray;
use crate::green::packed_rgb::{Rgb24, Rgbx32, Xrgb32};
use crate::green::packed_ycbcr::{Uyvy, Yuyv};
use crate::green::planar_ycbcr::{Nv12, Yu12, Yuv422p};
use crate::green::words::{Y10, Y16};
use crate::green::ycbcr::{Exact, Linear, QuantizationRange, YcbcrEncoding, YcbcrMatrix};

/// Checks taxels at any place of frames of any size, with any bytes between rows. The last row is as short as allowed.
fn check<G: GreenChannel>(name: &str, green: G) {
    let mut chance = Chance(1);
    for turn in 0..600 {
        let mut next = |below| chance.below(below) as u16;
        // Some are wider than sums of 16 bits allow.
        let width = if turn % 50 == 0 { 4_000 + next(500) } else { 16 + next(285) };
        let (x, y, count) = (next(9), next(4), 1 + next(9));
        let (frame_width, height) = (x + width + next(4), y + count + next(4));
        let least = green.row_bytes(frame_width);
        let bytes_per_row = least + usize::from(next(6));
        let chroma = green.chroma_bytes(bytes_per_row, height);
        let short = if chroma.is_some() { bytes_per_row } else { least };
        let length = bytes_per_row * usize::from(height - 1) + short + chroma.unwrap_or(0);
        let most = [1, 256, 30][turn % 3];
        let bytes: Vec<u8> = (0..length).map(|_| 255 - chance.below(most) as u8).collect();
        let rows = Rows::new(&bytes, bytes_per_row, 0, height);
        let run = Run { y, x, width, stride: Stride::One };
        let (mut block, mut runs) = (G::Sum::default(), G::Sum::default());
        green.add_block(&mut block, &rows, run, count);
        (y..y + count).for_each(|y| green.add_run(&mut runs, &rows, Run { y, ..run }));
        let frame = format!("{name}, {frame_width} × {height}, {bytes_per_row} bytes a row");
        assert_eq!(format!("{block:?}"), format!("{runs:?}"), "{frame}: {count} rows of {width} at {x}, {y}");
    }
}

#[test]
fn one_byte_of_a_pixel_is_summed_as_the_plain_code_does() {
    with_each_set(|_| {
        check("GREY", Gray);
        check("RGB24", Rgb24::default());
        check("32-bit RGB, green second", Rgbx32::default());
        check("32-bit RGB, green third", Xrgb32::default());
        check("Y16", Y16::default());
        check("Y10", Y10::default());
    });
}

#[test]
fn pixels_that_share_chroma_are_summed_as_the_plain_code_does() {
    with_each_set(|_| {
        for matrix in [YcbcrMatrix::Bt601, YcbcrMatrix::Bt709] {
            for range in [QuantizationRange::Limited, QuantizationRange::Full] {
                let exact = Exact::new(YcbcrEncoding { matrix, range });
                check("YUYV exact", Yuyv::new(exact));
                check("UYVY exact", Uyvy::new(exact));
                check("NV12 exact", Nv12::new(exact));
                check("YU12 exact", Yu12::new(exact));
                check("YUV422P exact", Yuv422p::new(exact));
            }
        }
        let linear = Linear::new(YcbcrEncoding::default());
        check("YUYV linear", Yuyv::new(linear));
        check("UYVY linear", Uyvy::new(linear));
        check("NV12 linear", Nv12::new(linear));
        check("YU12 linear", Yu12::new(linear));
        check("YUV422P linear", Yuv422p::new(linear));
    });
}
