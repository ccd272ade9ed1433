//! Properties from bytes to sums.

use proptest::prelude::*;
use wstac_core::taxels::TaxelSums;
use wstac_tests::plain_sums;
use wstac_tests::random::Random;
use wstac_tests::{formats, with_green_type};

use super::choice::{any_of, any_picture, camera_of, config};

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
