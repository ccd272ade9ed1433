//! Cuts the power at every byte that is written and in every erasure, and looks for the settings.

use std::collections::BTreeSet;
use std::vec::Vec;

use wstac_core::features::Floor;
use wstac_core::paper::trigger::TriggerConfig;

use super::*;
use crate::mock_flash::{Cut, Flash, SECTOR, each_cut};

const RANGE: Range<u32> = 1024..3072;

fn size() -> FrameSize {
    FrameSize::new(320, 240).unwrap()
}

/// Returns settings whose every part depends on a number.
fn settings(number: u16) -> Settings {
    let corners = core::array::from_fn(|k| [k as u16 * 9 + number % 50, k as u16 * 7 + number % 40]);
    let layout = Layout::new(size(), [20 + number % 10, 20], corners).unwrap();
    let trigger =
        TriggerConfig::new(5, 1.5 + f64::from(number), 15, wstac_core::paper::trigger::Rule::Signed, 0.5).unwrap();
    Settings::new(&layout, Floor::new(1.0 + f64::from(number % 200), 255).unwrap(), trigger, Some(number))
}

fn changed(change: impl FnOnce(&mut Settings)) -> Settings {
    let mut settings = settings(7);
    change(&mut settings);
    settings
}

fn kept(flash: &Flash) -> Option<Settings> {
    load(&mut flash.again(), RANGE)
}

#[test]
fn an_empty_or_arbitrary_flash_has_no_settings() {
    assert_eq!(kept(&Flash::new(RANGE)), None);
    for fill in [0x00, 0x5A, 0xA5] {
        let mut flash = Flash::new(RANGE);
        flash.bytes.fill(fill);
        flash.written.fill(true);
        assert_eq!(kept(&flash), None, "{fill:#x}");
        // It takes some all the same.
        assert_eq!(keep(&mut flash, RANGE, Some(&settings(1))), Ok(()), "{fill:#x}");
        assert_eq!(kept(&flash), Some(settings(1)), "{fill:#x}");
    }
}

#[test]
fn settings_are_kept_until_they_are_set_again_or_forgotten() {
    let mut flash = Flash::new(RANGE);
    // The sectors are filled many times.
    for number in 0..200 {
        keep(&mut flash, RANGE, Some(&settings(number))).unwrap();
        assert_eq!(kept(&flash), Some(settings(number)));
    }
    keep(&mut flash, RANGE, None).unwrap();
    assert_eq!(kept(&flash), None);
    keep(&mut flash, RANGE, Some(&settings(3))).unwrap();
    assert_eq!(kept(&flash), Some(settings(3)));
    // Nothing outside the range was written.
    assert!(flash.bytes[..SECTOR].iter().chain(&flash.bytes[3 * SECTOR..]).all(|byte| *byte == 0xFF));
}

#[test]
fn power_may_fail_at_every_byte() {
    let (mut cuts, mut erased, mut over) = (0, 0, 0);
    let mut seen = BTreeSet::new();
    // 16 changes fill both sectors more than once.
    let mut flash = Flash::new(RANGE);
    keep(&mut flash, RANGE, Some(&settings(0))).unwrap();
    for number in 1..=16 {
        let (old, new) = (settings(number - 1), settings(number));
        let mut whole = flash.again();
        whole.left = 100_000;
        keep(&mut whole, RANGE, Some(&new)).unwrap();
        let needed = 100_000 - whole.left;
        erased += u32::from(needed > SECTOR);
        for (left, cut) in each_cut(needed) {
            let mut failed = flash.until(left, cut);
            let _ = keep(&mut failed, RANGE, Some(&new));
            let found = kept(&failed);
            assert!(found == Some(old) || found == Some(new), "{number}, {cut:?} after {left} of {needed} bytes");
            seen.insert((number, found == Some(new)));
            cuts += 1;
            // The board goes on: it takes other settings, and they survive.
            if left % 11 == 0 {
                let mut next = failed.again();
                let other = settings(number + 100);
                assert_eq!(keep(&mut next, RANGE, Some(&other)), Ok(()), "{number}, {cut:?} after {left} bytes");
                over += next.again;
                assert_eq!(kept(&next), Some(other), "{number}, {cut:?} after {left} bytes");
            }
        }
        flash = whole.again();
    }
    assert!(erased >= 2, "no sector was erased: this shows less than it should");
    assert!(seen.iter().any(|(_, is_new)| *is_new) && seen.iter().any(|(_, is_new)| !is_new));
    assert!(cuts > 5000 && over > 0, "{cuts}, {over}");
}

#[test]
fn what_a_board_cannot_use_is_refused() {
    let of = |settings: &Settings| check(settings, size(), FrameRate::NOMINAL, 500);
    assert!(of(&settings(7)).is_ok());
    let Err(Refusal::Frame { found: [320, 240], expected: [640, 480] }) =
        check(&settings(7), FrameSize::new(640, 480).unwrap(), FrameRate::NOMINAL, 500)
    else {
        panic!("a layout for other frames passes")
    };
    let outside = changed(|settings| settings.corners = [[310, 0]; 25]);
    assert!(matches!(of(&outside), Err(Refusal::Layout(_))));
    let full_scale = changed(|settings| settings.floor = Floor::new(1.0, 1023).unwrap());
    assert!(matches!(of(&full_scale), Err(Refusal::Layout(_))));
    for found in [0, 501] {
        let expected = Err(Refusal::Exposure { found, most: 500 });
        assert_eq!(of(&changed(|settings| settings.exposure = Some(found))), expected);
    }
}

#[test]
fn a_kept_exposure_that_is_too_long_is_left_out() {
    let mut flash = Flash::new(RANGE);
    let of =
        |flash: &mut Flash, most| usable(flash, RANGE, size(), FrameRate::NOMINAL, most).map(|(settings, _)| settings);
    assert_eq!(of(&mut flash, 264), None);
    let kept = changed(|settings| settings.exposure = Some(265));
    keep(&mut flash, RANGE, Some(&kept)).unwrap();
    assert_eq!(of(&mut flash, 500), Some(kept));
    assert_eq!(of(&mut flash, 264), Some(changed(|settings| settings.exposure = None)));
    // What else a board cannot use is no settings.
    keep(&mut flash, RANGE, Some(&changed(|settings| settings.corners = [[310, 0]; 25]))).unwrap();
    assert_eq!(of(&mut flash, 264), None);
}

/// Returns a texture whose every part depends on a number.
fn texture(number: u16) -> KeptTexture {
    let numbers: Vec<i16> = (0..12).map(|d| (number * 31 + d * 7) as i16 * if d % 2 == 0 { 1 } else { -1 }).collect();
    let name = TextureName::new(&"texture of some material"[..1 + usize::from(number) % 23]).unwrap();
    let center = Center::new(Place::new(&numbers).unwrap(), 100_000 + u32::from(number));
    KeptTexture { model: 0x1234_5678, name, center }
}

/// Everything that a board keeps: the settings and the first three textures.
type All = (Option<Settings>, [Option<KeptTexture>; 3]);

fn all(flash: &Flash) -> All {
    let mut flash = flash.again();
    (load(&mut flash, RANGE), [0, 1, 2].map(|place| load_texture(&mut flash, RANGE, place)))
}

#[test]
fn textures_are_kept_beside_the_settings_until_they_are_forgotten() {
    let mut flash = Flash::new(RANGE);
    assert_eq!(all(&flash), (None, [None; 3]));
    // The longest item: all dimensions, with a long name.
    let numbers: Vec<i16> = (0..MOST_DIMENSIONS as i16).map(|d| i16::MIN + d).collect();
    let center = Center::new(Place::new(&numbers).unwrap(), u32::MAX);
    let longest = KeptTexture { model: u32::MAX, name: texture(22).name, center };
    for number in 0..100 {
        assert!(keep_texture(&mut flash, RANGE, 0, Some(&longest)));
        assert!(keep_texture(&mut flash, RANGE, 2, Some(&texture(number))));
        keep(&mut flash, RANGE, Some(&settings(number))).unwrap();
        assert_eq!(all(&flash), (Some(settings(number)), [Some(longest), None, Some(texture(number))]));
    }
    assert!(keep_texture(&mut flash, RANGE, 0, None));
    keep(&mut flash, RANGE, None).unwrap();
    assert_eq!(all(&flash), (None, [None, None, Some(texture(99))]));
    // A flash that fails keeps nothing, and says so.
    assert!(!keep_texture(&mut flash.until(0, Cut::Bytes), RANGE, 1, Some(&texture(1))));
    assert_eq!(all(&flash), (None, [None, None, Some(texture(99))]));
    // What is no map is erased, but only if nothing can be read from it.
    flash.bytes[RANGE.start as usize..RANGE.end as usize].fill(0x5A);
    assert!(keep_texture(&mut flash, RANGE, 1, Some(&texture(5))));
    assert_eq!(all(&flash), (None, [None, Some(texture(5)), None]));
}

#[test]
fn power_may_fail_at_every_byte_of_a_texture_and_of_settings_beside_it() {
    let mut flash = Flash::new(RANGE);
    keep(&mut flash, RANGE, Some(&settings(0))).unwrap();
    assert!(keep_texture(&mut flash, RANGE, 1, Some(&texture(7))));
    let (mut cuts, mut erased, mut news) = (0, 0, 0);
    for number in 1..=24_u16 {
        // In turn, a texture is learned, another one is learned or forgotten, and settings are set.
        let change = |flash: &mut Flash| match number % 3 {
            0 => keep_texture(flash, RANGE, 0, Some(&texture(number))),
            1 => keep_texture(flash, RANGE, 2, (number % 2 == 0).then_some(texture(number)).as_ref()),
            _ => keep(flash, RANGE, Some(&settings(number))).is_ok(),
        };
        let mut whole = flash.again();
        whole.left = 100_000;
        assert!(change(&mut whole));
        let (old, new, needed) = (all(&flash), all(&whole), 100_000 - whole.left);
        erased += u32::from(needed > SECTOR);
        for (left, cut) in each_cut(needed) {
            let mut failed = flash.until(left, cut);
            change(&mut failed);
            let found = all(&failed);
            assert!(found == old || found == new, "{number}, {cut:?} after {left} of {needed} bytes: {found:?}");
            cuts += 1;
            news += u32::from(found == new && old != new);
            if left % 11 == 0 {
                let mut next = failed.again();
                assert!(change(&mut next), "{number}, {cut:?} after {left} bytes");
                assert_eq!(all(&next), new, "{number}, {cut:?} after {left} bytes");
            }
        }
        flash = whole.again();
    }
    assert!(erased >= 2 && cuts > 5000 && news > 0, "{erased} {cuts} {news}");
}
