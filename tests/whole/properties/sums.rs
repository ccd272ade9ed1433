//! Properties from bytes to sums.

use proptest::prelude::*;
use wstac_core::green::any::PixelFormat;
use wstac_core::green::bayer::BayerOrder;
use wstac_core::green::ycbcr::{QuantizationRange, YcbcrEncoding};
use wstac_core::taxels::TaxelSums;
use wstac_tests::plain_sums::{self, Picture};
use wstac_tests::random::Random;
use wstac_tests::{formats, with_green_type};

use super::choice::{any_color, any_method, any_of, any_picture, camera_of, config};

proptest! {
    #![proptest_config(config(1200))]

    #[test]
    fn sums_are_those_of_the_plain_model(picture in any_picture(), seed in any::<u64>()) {
        let bytes = Random::new(seed).bytes(picture.bytes());
        let (pixels, sums) = picture.sums(&bytes);
        let expected = sums.map(|sum| sum as u32);
        let camera = camera_of(any_of(&picture), &picture);
        prop_assert_eq!(u64::from(camera.pixels()), pixels);
        prop_assert_eq!(u64::from(camera.full_scale()), plain_sums::full_scale(picture.format));
        prop_assert_eq!(camera.frame_bytes(), picture.bytes());
        let mut any = TaxelSums::new(camera);
        prop_assert_eq!(any.push_frame(&bytes).unwrap(), expected);
        // The sums start from zero again, and a frame that is one byte too short is refused.
        prop_assert!(any.push_frame(&bytes[1..]).is_err());
        prop_assert_eq!(any.push_frame(&bytes).unwrap(), expected);
        let typed = with_green_type!(picture.format, picture.color, picture.method, green => {
            TaxelSums::new(camera_of(green, &picture)).push_frame(&bytes).unwrap()
        });
        prop_assert_eq!(typed, expected);
    }

    #[test]
    fn any_split_into_stripes_gives_the_sums_of_the_whole_frame(picture in any_picture(), seed in any::<u64>()) {
        let mut random = Random::new(seed);
        let bytes = random.bytes(picture.bytes());
        let mut whole = TaxelSums::new(camera_of(any_of(&picture), &picture));
        let expected = whole.push_frame(&bytes).unwrap();
        let mut striped = TaxelSums::new(camera_of(any_of(&picture), &picture));
        if formats::is_planar(picture.format) {
            prop_assert!(striped.push_stripe(&bytes).is_err());
            return Ok(());
        }
        let (mut row, mut sums) = (0, None);
        while row < picture.height {
            prop_assert!(sums.is_none(), "sums before the last row");
            let rows = (1 + random.below(5) as usize).min(picture.height - row);
            let (start, end) = (row * picture.bytes_per_row, (row + rows) * picture.bytes_per_row);
            // The padding after a stripe's last row may be missing.
            let padding = picture.bytes_per_row - plain_sums::row_bytes(picture.format, picture.width);
            let cut = random.below(padding as u64 + 1) as usize;
            sums = striped.push_stripe(&bytes[start..(end - cut).min(bytes.len())]).unwrap();
            row += rows;
        }
        prop_assert_eq!(sums, Some(expected));
    }

    #[test]
    fn an_abandoned_frame_leaves_nothing_behind(picture in any_picture(), rows in 0_usize..40, seed in any::<u64>()) {
        prop_assume!(!formats::is_planar(picture.format));
        let bytes = Random::new(seed).bytes(picture.bytes());
        let mut accumulators = TaxelSums::new(camera_of(any_of(&picture), &picture));
        let expected = accumulators.push_frame(&bytes).unwrap();
        let rows = rows.min(picture.height - 1);
        prop_assert_eq!(accumulators.push_stripe(&bytes[..rows * picture.bytes_per_row]).unwrap(), None);
        prop_assert_eq!(accumulators.push_frame(&bytes).is_err(), rows > 0);
        accumulators.abandon_frame();
        prop_assert_eq!(accumulators.push_frame(&bytes).unwrap(), expected);
    }
}

/// Returns the bytes of one gray picture in another format, without padding. `levels` has its pixels row by row.
fn in_format(format: PixelFormat, levels: &[u8], width: usize, random: &mut Random) -> Vec<u8> {
    use PixelFormat as F;
    let words = |factor: u16| levels.iter().flat_map(|&v| (u16::from(v) * factor).to_le_bytes()).collect();
    let pairs = || levels.chunks(width).flat_map(|row| row.chunks(2));
    let second = |pair: &[u8]| pair.get(1).copied().unwrap_or(0);
    let planes = |row_bytes: usize, chroma: usize| {
        let padded =
            levels.chunks(width).flat_map(|row| row.iter().copied().chain(std::iter::repeat_n(7, row_bytes - width)));
        padded.chain(std::iter::repeat_n(128, chroma)).collect()
    };
    let (height, cells) = (levels.len() / width, width.div_ceil(2));
    match format {
        F::Gray | F::Bayer8(_) => levels.to_vec(),
        F::Y10 | F::Bayer10(_) => words(4),
        F::Y12 | F::Bayer12(_) => words(16),
        F::Y16 => words(257),
        F::Rgb24 | F::Bgr24 => levels.iter().flat_map(|&v| [random.bits() as u8, v, random.bits() as u8]).collect(),
        F::Rgbx32 => levels.iter().flat_map(|&v| [random.bits() as u8, v, random.bits() as u8, 9]).collect(),
        F::Xrgb32 => levels.iter().flat_map(|&v| [9, random.bits() as u8, v, random.bits() as u8]).collect(),
        F::Rgb565 => {
            let red_and_blue = random.bits() as u16 & 0xF81F;
            levels.iter().flat_map(|&v| (u16::from(v) >> 2 << 5 | red_and_blue).to_le_bytes()).collect()
        }
        F::Yuyv => pairs().flat_map(|pair| [pair[0], 128, second(pair), 128]).collect(),
        F::Uyvy => pairs().flat_map(|pair| [128, pair[0], 128, second(pair)]).collect(),
        F::Nv12 => planes(2 * cells, 2 * cells * height.div_ceil(2)),
        F::Yu12 => planes(width, 2 * cells * height.div_ceil(2)),
        F::Yuv422p => planes(width, 2 * cells * height),
        F::Yuv444p => planes(width, 2 * levels.len()),
        _ => panic!("{format:?} is not written, expected every format"),
    }
}

proptest! {
    #![proptest_config(config(250))]

    #[test]
    fn formats_agree_on_one_gray_picture(picture in any_picture(), method in any_method(), seed in any::<u64>()) {
        let mut random = Random::new(seed);
        let levels = random.bytes(picture.width * picture.height);
        let sums_in = |format: PixelFormat, levels: &[u8], random: &mut Random| {
            let color = YcbcrEncoding { matrix: picture.color.matrix, range: QuantizationRange::Full };
            let bytes_per_row = plain_sums::row_bytes(format, picture.width);
            let picture = Picture { format, color, method, bytes_per_row, ..picture.clone() };
            let bytes = in_format(format, levels, picture.width, random);
            TaxelSums::new(camera_of(any_of(&picture), &picture)).push_frame(&bytes).unwrap()
        };
        let gray = sums_in(PixelFormat::Gray, &levels, &mut random);
        let widened: Vec<u8> = levels.iter().map(|&v| v >> 2 << 2 | v >> 6).collect();
        for format in PixelFormat::all() {
            let expected = match format {
                PixelFormat::Y10 => gray.map(|sum| sum * 4),
                PixelFormat::Y12 => gray.map(|sum| sum * 16),
                PixelFormat::Y16 => gray.map(|sum| sum * 257),
                PixelFormat::Rgb565 => sums_in(PixelFormat::Gray, &widened, &mut random),
                // A mosaic sees half the pixels; it is compared below.
                PixelFormat::Bayer8(_) | PixelFormat::Bayer10(_) | PixelFormat::Bayer12(_) => continue,
                _ => gray,
            };
            prop_assert_eq!(sums_in(format, &levels, &mut random), expected, "{:?}", format);
        }
        // Orders with green on the same diagonal must give equal sums, at every bit depth.
        let mosaic = BayerOrder::ALL.map(|order| sums_in(PixelFormat::Bayer8(order), &levels, &mut random));
        prop_assert_eq!(mosaic[0], mosaic[3]);
        prop_assert_eq!(mosaic[1], mosaic[2]);
        for (order, eight) in BayerOrder::ALL.into_iter().zip(mosaic) {
            prop_assert_eq!(sums_in(PixelFormat::Bayer10(order), &levels, &mut random), eight.map(|sum| sum * 4));
            prop_assert_eq!(sums_in(PixelFormat::Bayer12(order), &levels, &mut random), eight.map(|sum| sum * 16));
        }
        // Both diagonals together are the gray picture if cells are counted like pixels.
        if picture.stride == 1 {
            let even = |x: usize| x & !1;
            let snapped = Picture {
                format: PixelFormat::Gray,
                bytes_per_row: picture.width,
                taxel: picture.taxel.map(even),
                corners: picture.corners.map(|corner| corner.map(even)),
                ..picture.clone()
            };
            let (_, sums) = snapped.sums(&levels);
            for ((a, b), whole) in mosaic[0].into_iter().zip(mosaic[1]).zip(sums) {
                prop_assert_eq!(u64::from(a + b), whole);
            }
        }
    }

    #[test]
    fn ycbcr_layouts_agree_on_one_picture(
        picture in any_picture(), color in any_color(), method in any_method(), seed in any::<u64>(),
    ) {
        let (width, height) = (picture.width & !1, picture.height & !1);
        let taxel = [picture.taxel[0].min(width), picture.taxel[1].min(height)];
        let corners = picture.corners.map(|[x, y]| [x.min(width - taxel[0]), y.min(height - taxel[1])]);
        let mut random = Random::new(seed);
        let luma = random.bytes(width * height);
        // One chroma sample for 2 × 2 pixels, in each memory layout.
        let (cb, cr) = (random.bytes(width * height / 4), random.bytes(width * height / 4));
        let cell = |x: usize, y: usize| y / 2 * (width / 2) + x / 2;
        let pixels = || (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let pairs = || pixels().filter(|(x, _)| x % 2 == 0);
        let at = |x: usize, y: usize| luma[y * width + x];
        let yuyv = pairs().flat_map(|(x, y)| [at(x, y), cb[cell(x, y)], at(x + 1, y), cr[cell(x, y)]]).collect::<Vec<u8>>();
        let uyvy = yuyv.chunks(2).flat_map(|pair| [pair[1], pair[0]]).collect::<Vec<u8>>();
        let nv12 = [luma.clone(), cb.iter().zip(&cr).flat_map(|(&cb, &cr)| [cb, cr]).collect()].concat();
        let yu12 = [luma.clone(), cb.clone(), cr.clone()].concat();
        let half = |plane: &[u8]| pairs().map(|(x, y)| plane[cell(x, y)]).collect::<Vec<u8>>();
        let full = |plane: &[u8]| pixels().map(|(x, y)| plane[cell(x, y)]).collect::<Vec<u8>>();
        let yuv422p = [luma.clone(), half(&cb), half(&cr)].concat();
        let yuv444p = [luma.clone(), full(&cb), full(&cr)].concat();
        let sums = [
            (PixelFormat::Yuyv, yuyv), (PixelFormat::Uyvy, uyvy), (PixelFormat::Nv12, nv12),
            (PixelFormat::Yu12, yu12), (PixelFormat::Yuv422p, yuv422p), (PixelFormat::Yuv444p, yuv444p),
        ].map(|(format, bytes)| {
            let bytes_per_row = plain_sums::row_bytes(format, width);
            let picture = Picture { format, color, method, width, height, bytes_per_row, taxel, corners, ..picture };
            TaxelSums::new(camera_of(any_of(&picture), &picture)).push_frame(&bytes).unwrap()
        });
        for other in &sums[1..] {
            prop_assert_eq!(other, &sums[0]);
        }
    }
}
