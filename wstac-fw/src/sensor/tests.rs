//! Tests every step on the bus, in order, and every way in which a step can fail.

use std::vec::Vec;
use std::{iter, slice};

use embedded_hal::i2c::{ErrorKind, NoAcknowledgeSource};
use embedded_hal_mock::eh1::delay::{CheckedDelay, NoopDelay, Transaction as Wait};
use embedded_hal_mock::eh1::i2c::{Mock, Transaction};
use wstac_core::wire::RegisterValues;

use super::gc2145::{GC2145, gc2145};
use super::hm01b0::{DataWires, HM01B0, hm01b0, with};
use super::hm0360::{HM0360, hm0360};
use super::mt9m114::{MT9M114, mt9m114};
use super::ov2640::{OV2640, ov2640};
use super::ov5640::{OV5640, ov5640};
use super::ov7670::{OV7670, ov7670};
use super::ov7690::{OV7690, ov7690};
use super::ov7692::{OV7692, ov7692};
use super::ov7725::{OV7725, ov7725};
use super::watch::Watch;
use super::{Addressing, CameraSensor, ExposurePart, RESTS, SensorError, Setting, longest_exposure};

const OMNIVISION: [CameraSensor; 5] = [OV7690, OV7692, OV7725, OV7670, OV2640];
const ALL: [CameraSensor; 14] = [
    OV7690,
    OV7692,
    OV7725,
    OV7670,
    HM0360,
    HM01B0,
    OV2640,
    GC2145,
    OV5640,
    MT9M114,
    // One with numbers of two bytes and without commands.
    CameraSensor { commands: None, ..MT9M114 },
    hm01b0(DataWires::One),
    hm01b0(DataWires::Four),
    hm01b0(DataWires::Eight),
];

/// Returns the steps on the bus that read this value.
fn is_read(sensor: &CameraSensor, Setting { register, value }: Setting) -> Vec<Transaction> {
    let [high, low] = register.to_be_bytes();
    match sensor.addressing {
        // A stop lies between the two: each transaction of the mock stands alone.
        Addressing::Byte => Vec::from([
            Transaction::write(sensor.address, [low].into()),
            Transaction::read(sensor.address, [value].into()),
        ]),
        Addressing::Word => Vec::from([Transaction::write_read(sensor.address, [high, low].into(), [value].into())]),
        Addressing::Wide => {
            let both = if low % 2 == 0 { [value, 0x5A] } else { [0x5A, value] };
            Vec::from([Transaction::write_read(sensor.address, [high, low & 0xFE].into(), both.into())])
        }
    }
}

fn is_written(sensor: &CameraSensor, Setting { register, value }: Setting) -> Transaction {
    let [high, low] = register.to_be_bytes();
    let bytes = if sensor.addressing == Addressing::Byte { Vec::from([low, value]) } else { [high, low, value].into() };
    Transaction::write(sensor.address, bytes)
}

/// Returns settings in groups that one transfer writes: two bytes of a number, or else one.
fn groups<'a>(sensor: &CameraSensor, settings: &'a [Setting]) -> impl Iterator<Item = &'a [Setting]> {
    let is_wide = sensor.addressing == Addressing::Wide;
    settings.chunk_by(move |a, b| is_wide && a.register % 2 == 0 && b.register == a.register + 1)
}

/// Returns the step that writes a group, with its register.
fn write_of(sensor: &CameraSensor, group: &[Setting]) -> (u16, Transaction) {
    let [high, low] = group[0].register.to_be_bytes();
    let pair = || [high, low, group[0].value, group[1].value].into();
    let step = if group.len() == 2 { Transaction::write(sensor.address, pair()) } else { is_written(sensor, group[0]) };
    (group[0].register, step)
}

fn settings(sensor: &CameraSensor) -> Vec<Setting> {
    sensor.once.iter().chain(sensor.settings.iter().copied().flatten()).copied().collect()
}

/// Returns the settings of a number of two bytes.
fn number(register: u16, value: u16) -> [Setting; 2] {
    let [high, low] = value.to_be_bytes();
    [Setting { register, value: high }, Setting { register: register + 1, value: low }]
}

/// Returns all steps on the bus if nothing is wrong, each with the register that it is about.
fn steps(sensor: &CameraSensor) -> Vec<(u16, Transaction)> {
    let reads = |setting: Setting| is_read(sensor, setting).into_iter().map(move |step| (setting.register, step));
    // A command is done at once, without an error; other bits do not matter.
    let done = [(0x0081, 0xF0), (0x0081, 0xF0), (0x0080, 0x8F)].map(|(register, value)| Setting { register, value });
    let waits = || done.into_iter().filter(|_| sensor.commands.is_some()).flat_map(reads);
    let mut steps: Vec<_> = sensor.bank.iter().map(|setting| write_of(sensor, &[*setting])).collect();
    steps.extend(sensor.identity.into_iter().flat_map(reads));
    let whole = number(0x001A, 1);
    steps.push(write_of(
        sensor,
        if sensor.addressing == Addressing::Wide { &whole } else { slice::from_ref(&sensor.reset) },
    ));
    steps.extend(sensor.commands.map(|_| write_of(sensor, &number(0x001A, 0))));
    steps.extend(waits());
    for group in groups(sensor, &settings(sensor)) {
        steps.push(write_of(sensor, group));
        steps.extend(group.iter().copied().flat_map(reads));
    }
    steps.extend(sensor.start.iter().map(|setting| write_of(sensor, &[*setting])));
    steps.extend(sensor.commands.map(|_| write_of(sensor, &number(0x0080, 0x8002))));
    steps.extend(waits());
    steps
}

/// Returns the steps without their registers.
fn whole(sensor: &CameraSensor) -> Vec<Transaction> {
    steps(sensor).into_iter().map(|(_, step)| step).collect()
}

/// Sets the sensor up over a bus that expects these steps and no others.
fn set_up(sensor: &CameraSensor, steps: &[Transaction]) -> Result<(), SensorError<ErrorKind>> {
    let mut bus = Mock::new(steps);
    let done = sensor.set_up(&mut bus, &mut NoopDelay);
    bus.done();
    done
}

#[test]
fn a_sensor_is_identified_reset_and_set_up_and_every_setting_read_back() {
    for sensor in ALL {
        assert_eq!(set_up(&sensor, &whole(&sensor)), Ok(()), "{}", sensor.name);
    }
}

#[test]
fn another_sensor_is_named_and_nothing_is_written_to_it() {
    let mut steps = is_read(&OV7725, OV7690.identity[0]);
    steps.extend(is_read(&OV7725, OV7690.identity[1]));
    assert_eq!(set_up(&OV7725, &steps), Err(SensorError::Identity { found: 0x7691, expected: 0x7721 }));
}

#[test]
fn no_acknowledge_at_any_step_ends_it_there_and_names_the_register() {
    let error = ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address);
    for sensor in ALL {
        for (at, (expected, _)) in steps(&sensor).into_iter().enumerate() {
            let mut steps = whole(&sensor)[..=at].to_vec();
            steps[at] = steps[at].clone().with_error(error);
            let Err(SensorError::Bus { register, error: found }) = set_up(&sensor, &steps) else {
                panic!("{}, step {at}: no error", sensor.name)
            };
            assert_eq!((register, found), (expected, error), "{}, step {at}", sensor.name);
        }
    }
}

#[test]
fn a_setting_that_is_not_taken_is_named() {
    for sensor in ALL {
        let whole = whole(&sensor);
        // The first write of a setting: reads of the identity come before it.
        let first = write_of(&sensor, groups(&sensor, &settings(&sensor)).next().unwrap()).1;
        let mut at = whole.iter().position(|step| *step == first).unwrap();
        for setting in settings(&sensor) {
            let read = is_read(&sensor, setting);
            at += whole[at..].windows(read.len()).position(|steps| steps == read).unwrap();
            let mut steps = whole[..at].to_vec();
            at += read.len();
            let found = setting.value ^ 1;
            steps.extend(is_read(&sensor, Setting { value: found, ..setting }));
            let values = RegisterValues { address: sensor.address, found, expected: setting.value };
            let error = SensorError::NotTaken { register: setting.register, values };
            assert_eq!(set_up(&sensor, &steps), Err(error), "{}", sensor.name);
        }
    }
}

#[test]
fn a_command_is_waited_for_and_its_failure_is_named() {
    let (sensor, whole) = (MT9M114, whole(&MT9M114));
    let (before, done) = whole.split_at(whole.len() - 3);
    let read = |register, value| is_read(&sensor, Setting { register, value });
    let ends = |end: &[Vec<Transaction>]| set_up(&sensor, &[before, &end.concat()].concat());
    let busy = |times| iter::repeat_n(read(0x0081, 0x02), times).flatten().collect::<Vec<_>>();
    assert_eq!(ends(&[busy(500), done[1..].into()]), Ok(()));
    // Into reset, and out of it.
    let (mut bus, mut waits) = (Mock::new(&whole), CheckedDelay::new(&[Wait::delay_ms(45), Wait::delay_ms(45)]));
    assert_eq!(sensor.set_up(&mut bus, &mut waits), Ok(()));
    (bus.done(), waits.done());
    assert!(sensor.longest_set_up() >= 2 * 45 + 2 * 500 + settings(&sensor).len() as u32);
    let not_taken = |register, found, expected| {
        let values = RegisterValues { address: sensor.address, found, expected };
        Err(SensorError::NotTaken { register, values })
    };
    assert_eq!(ends(&[busy(501)]), not_taken(0x0081, 0x02, 0x00));
    assert_eq!(ends(&[done[..2].into(), read(0x0080, 0x7F)]), not_taken(0x0080, 0x00, 0x80));
}

#[test]
fn the_test_pattern_is_shown_and_gone_again() {
    for sensor in ALL {
        for is_shown in [true, false] {
            let mut steps = Vec::new();
            for &pattern in sensor.pattern {
                let before = *settings(&sensor).iter().find(|setting| setting.register == pattern.register).unwrap();
                assert_ne!(before, pattern);
                let setting = if is_shown { pattern } else { before };
                steps.push(is_written(&sensor, setting));
                steps.extend(is_read(&sensor, setting));
            }
            if !sensor.pattern.is_empty() {
                steps.extend(sensor.start.iter().map(|setting| is_written(&sensor, *setting)));
            }
            let mut bus = Mock::new(&steps);
            assert_eq!(sensor.show_pattern(&mut bus, is_shown), Ok(()), "{}", sensor.name);
            bus.done();
        }
    }
    assert!(OMNIVISION.iter().all(|sensor| sensor.pattern.is_empty()) && !ALL[5].pattern.is_empty());
}

#[test]
fn automatic_controls_are_off_before_their_values_are_set() {
    for sensor in ALL {
        let settings: Vec<_> = sensor.settings.iter().copied().flatten().copied().collect();
        let place = |register| settings.iter().position(|setting| setting.register == register).unwrap();
        // A one of the OV5640 fixes what it stands for.
        let off = if sensor.name == "OV5640" { 3 } else { 0 };
        assert_eq!(settings[place(sensor.switches)].value & 7, off, "{}", sensor.name);
        // Gain, blue, red, green, and exposure follow.
        let gains: &[u16] = match (sensor.name, sensor.addressing) {
            ("OV2640", _) => &[0x00],
            ("GC2145", _) => &[0xB0, 0xB3, 0xB4, 0xB5],
            ("MT9M114", _) => &[0xC836, 0xC837],
            ("OV5640", _) => &[0x350A, 0x350B, 0x3400, 0x3401, 0x3402, 0x3403, 0x3404, 0x3405],
            (_, Addressing::Byte) => &[0x00, 0x01, 0x02, 0x03],
            _ => &[0x0205, 0x020E, 0x020F],
        };
        let mut values = sensor.exposure.iter().map(|part| part.register).chain(gains.iter().copied());
        assert!(values.all(|value| place(value) > place(sensor.switches)), "{}", sensor.name);
        // No setting resets it again, and none is undone by a later one.
        for (k, setting) in settings.iter().enumerate() {
            assert_ne!(*setting, sensor.reset);
            assert_eq!(place(setting.register), k, "{}: {:#04x} twice", sensor.name, setting.register);
        }
    }
}

#[test]
fn a_clock_that_is_too_fast_is_divided_once() {
    assert!(!hm01b0(DataWires::Eight).slow_down(2));
    let mut slow = HM0360;
    assert!(slow.slow_down(2) && slow.table().any(|setting| setting == Setting { register: 0x0300, value: 0x0A }));
    // Dividers in the high four bits, one of them less 1.
    for (sensor, register, divider) in [(OV5640, 0x3035, 2), (GC2145, 0xFA, 3)] {
        for times in [2, 4] {
            let mut slow = sensor;
            let less = u32::from(register == 0xFA);
            assert!(slow.slow_down(times) && at(&slow, register) >> 4 == times * divider - less, "{}", sensor.name);
        }
    }
    for sensor in OMNIVISION {
        let [half, quarter] = sensor.slower.unwrap();
        let mut slow = sensor;
        assert!(!slow.slow_down(1) && !slow.slow_down(3) && slow.slow_down(2) && !slow.slow_down(4), "{}", sensor.name);
        let changed: Vec<_> = sensor.table().zip(slow.table()).filter(|(before, after)| before != after).collect();
        let [(before, after)] = changed[..] else { panic!("{changed:?}") };
        assert_eq!((before.register, after.register, after.value), (0x11, 0x11, half));
        // The divider is 1 plus the register, which the OV7725 doubles.
        assert_eq!(u32::from(after.value) + 1, 2 * (u32::from(before.value) + 1), "{}", sensor.name);
        assert_eq!(u32::from(quarter) + 1, 4 * (u32::from(before.value) + 1), "{}", sensor.name);
    }
}

/// Returns the exposure of a sensor's table, in lines.
fn exposure(sensor: &CameraSensor) -> u32 {
    let part = |part: &ExposurePart| {
        let setting = sensor.table().find(|setting| setting.register == part.register).unwrap();
        u32::from(setting.value & part.mask) << part.from
    };
    let sixteenths: u32 = sensor.exposure.iter().map(part).sum();
    sixteenths >> 4
}

#[test]
fn another_exposure_changes_its_registers_alone() {
    for sensor in ALL {
        for lines in [1, 2, 3, 100, sensor.longest_exposure - 1, sensor.longest_exposure] {
            let other = CameraSensor { lines: Some(lines), ..sensor };
            assert_eq!(exposure(&other), u32::from(lines), "{}", sensor.name);
            for (before, after) in sensor.table().zip(other.table()).filter(|(before, after)| before != after) {
                let part = sensor.exposure.iter().find(|part| part.register == before.register).unwrap();
                assert_eq!(before.value & !part.mask, after.value & !part.mask, "{}", sensor.name);
            }
        }
    }
}

#[test]
fn the_longest_exposure_fits_in_a_frame() {
    // The lines of a frame, less those that drivers leave: two of the HM01B0, and four of OmniVision's.
    for (sensor, most) in [
        (OV7725, 510 - 4),
        (OV7690, 516 - 4),
        (OV7692, 516 - 4),
        (OV7670, 510 - 4),
        (OV2640, 672 - 4),
        (OV5640, 984 - 4),
        (GC2145, 415 - 8),
        (MT9M114, 464 - 2),
    ] {
        assert!(sensor.longest_exposure <= most, "{}", sensor.name);
    }
    let sensor = hm01b0(DataWires::One);
    let byte = |register| sensor.table().find(|setting| setting.register == register).unwrap().value;
    assert_eq!(sensor.longest_exposure, u16::from_be_bytes([byte(0x0340), byte(0x0341)]) - 2);
    // The table's own exposure is not longer. A board takes the longest of all its sensors until it has found one.
    for sensor in ALL {
        assert!(exposure(&sensor) <= u32::from(sensor.longest_exposure), "{}", sensor.name);
    }
    let longest = |sensor: CameraSensor| sensor.longest_exposure;
    assert_eq!([OV7725, GC2145, OV5640, hm01b0(DataWires::One)].map(longest), [500, 399, 974, 264]);
    assert_eq!((longest_exposure(&OMNIVISION), longest_exposure(&ALL)), (662, 974));
}

#[test]
fn rates_readouts_and_exposures_are_those_of_the_tables() {
    at_a_rate::<15, false>();
    at_a_rate::<25, false>();
    at_a_rate::<30, false>();
    at_a_rate::<31, true>();
    at_a_rate::<45, true>();
    at_a_rate::<60, true>();
    let slow: [fn(); 4] = [at_a_slow_rate::<15>, at_a_slow_rate::<20>, at_a_slow_rate::<25>, at_a_slow_rate::<30>];
    slow.iter().for_each(|checks| checks());
    // The clock of one wire would be 48 MHz.
    let lines = |sensor: CameraSensor| sensor.table().find(|set| set.register == 0x3060).unwrap().value & 3;
    assert_eq!([DataWires::Four, DataWires::Eight].map(|wires| lines(with::<60, true, 1>(wires))), [1, 1]);
}

/// Returns a register of a sensor's table.
fn at(sensor: &CameraSensor, register: u16) -> u32 {
    u32::from(sensor.table().find(|setting| setting.register == register).unwrap().value)
}

/// Returns a number of two registers.
fn word(sensor: &CameraSensor, register: u16) -> u32 {
    at(sensor, register) << 8 | at(sensor, register + 1)
}

/// Checks sensors with at most 30 frames per second.
fn at_a_slow_rate<const FPS: u32>() {
    let sensor = ov7670::<FPS>();
    let clock = 24_000 * [1, 4, 6, 8][(at(&sensor, 0x6B) >> 6) as usize] / (1 + (at(&sensor, 0x11) & 0x3F));
    let rows = 1 << (at(&sensor, 0x72) >> 4 & 3);
    let lines = 510 + (at(&sensor, 0x2E) << 8 | at(&sensor, 0x2D));
    has_rate(&sensor, FPS, rows, 2 * 784, lines, clock);

    // 800 x 600 of 1190 x 672, a clock per pixel.
    let sensor = ov2640::<FPS>();
    assert_eq!(at(&sensor, 0x12) & 0x70, 0x40);
    let lines = 672 + (at(&sensor, 0x2E) << 8 | at(&sensor, 0x2D));
    has_rate(&sensor, FPS, 600.0 / 240.0, 1190, lines, 24_000 / (1 + at(&sensor, 0x11)));

    let sensor = ov5640::<FPS>();
    let pll = 24_000 / (at(&sensor, 0x3037) & 15) * at(&sensor, 0x3036) / (at(&sensor, 0x3035) >> 4);
    let pll = pll / (1 + (at(&sensor, 0x3037) >> 4)) / 2;
    let rows = ((word(&sensor, 0x3806) + 1 - word(&sensor, 0x3802)) / 2 - 2 * word(&sensor, 0x3812)) / 240;
    let clock = pll >> (at(&sensor, 0x3108) & 3);
    has_rate(&sensor, FPS, rows, word(&sensor, 0x380C), word(&sensor, 0x380E), clock);
    // The camera interface takes 28.8 MHz.
    assert!(pll >> (at(&sensor, 0x3108) >> 4) <= 28_750);

    let sensor = gc2145::<FPS>();
    let clock = 6_000 * (1 + (at(&sensor, 0xF8) & 0x3F)) / (1 + (at(&sensor, 0xFA) >> 4));
    let clocks = word(&sensor, 0x05) + word(&sensor, 0x11) + word(&sensor, 0x0F) / 2 + 4;
    let lines = word(&sensor, 0x07) + word(&sensor, 0x0D) + 16;
    has_rate(&sensor, FPS, 1, clocks, lines, clock);
    assert!(4 * clock <= 28_750);

    // A pixel of two bytes for each two of the clocks that come in, of sums of two rows.
    let sensor = mt9m114::<FPS>();
    assert_eq!((at(&sensor, 0xC97E), word(&sensor, 0xC834)), (0, 0x0330));
    let clock = (word(&sensor, 0xC808) << 16 | word(&sensor, 0xC80A)) / 1000;
    assert_eq!(clock, 24_000 / 2);
    has_rate(&sensor, FPS, 1, word(&sensor, 0xC814), word(&sensor, 0xC812), clock);
}

fn at_a_rate<const FPS: u32, const IS_FAST: bool>() {
    // Rows of the array for each row of the picture, clocks of a line, lines of a frame, clocks per millisecond.
    let all = [ov7690::<FPS>(), ov7692::<FPS>()].map(|sensor| {
        let pixels = (at(&sensor, 0x2A) & 0x70) << 4 | at(&sensor, 0x2B);
        let pll = 24_000 * [1, 4, 6, 8][(at(&sensor, 0x29) >> 4 & 3) as usize] / ((at(&sensor, 0x29) >> 6) + 1);
        let clock = pll / ((at(&sensor, 0x11) & 0x3F) + 1) / 2;
        let lines = if at(&sensor, 0x12) & 0x40 != 0 { 258 } else { 516 };
        let lines = lines + ((at(&sensor, 0x2A) & 15) << 8 | at(&sensor, 0x2C));
        (sensor, word(&sensor, 0xCA) / word(&sensor, 0xCE), 2 * pixels, lines, clock)
    });
    let sensor = ov7725::<FPS>();
    let pll = 24_000 * [1, 4, 6, 8][(at(&sensor, 0x0D) >> 6) as usize] / (2 * (1 + (at(&sensor, 0x11) & 0x3F)));
    let rows = 2 * at(&sensor, 0x1A) / (2 * at(&sensor, 0x2C));
    let [pixels, lines] = if at(&sensor, 0x12) & 0x40 != 0 { [576, 278] } else { [784, 510] };
    let lines = lines + (at(&sensor, 0x2E) << 8 | at(&sensor, 0x2D));
    let ov7725 = (sensor, rows, 2 * (pixels + at(&sensor, 0x2B)), lines, pll);
    let wires = if FPS > 30 { [DataWires::Eight; 3] } else { [DataWires::One, DataWires::Four, DataWires::Eight] };
    let hm01b0 =
        wires.map(with::<FPS, IS_FAST, 1>).into_iter().chain([with::<FPS, true, 1>(DataWires::Eight)]).map(|sensor| {
            let clock = 24_000 / [8, 4, 2, 1][(at(&sensor, 0x3060) & 3) as usize];
            (sensor, 1, word(&sensor, 0x0342), word(&sensor, 0x0340), clock)
        });
    let sensor = hm0360::<FPS>();
    // The rate as drivers set it: half of what they count.
    let clock = (24_000 >> (at(&sensor, 0x0300) & 3)) / 2;
    has_rate(&sensor, FPS, 1, word(&sensor, 0x0342), word(&sensor, 0x0340), clock);
    for (sensor, rows, clocks, lines, clock) in all.into_iter().chain([ov7725]).chain(hm01b0) {
        has_rate(&sensor, FPS, rows, clocks, lines, clock);
    }
}

/// Checks a sensor with so many rows of the array for each of the picture, clocks of a line, lines of a frame, and
/// clocks per millisecond.
fn has_rate(sensor: &CameraSensor, fps: u32, rows: impl Into<f64>, clocks: u32, lines: u32, clock: u32) {
    let row_ms = rows.into() * f64::from(clocks) / f64::from(clock);
    let between = f64::from(sensor.size.height() - 1);
    assert!((f64::from(sensor.readout.ms()) - between * row_ms).abs() < 1e-5, "{}: {row_ms}", sensor.name);
    // The same clocks give the rate, which the firmware measures.
    let rate = f64::from(clock) * 1000.0 / f64::from(clocks * lines);
    assert!((rate / f64::from(fps) - 1.0).abs() < 0.004, "{}: {rate}", sensor.name);
    // Frames are six when settings have settled, and the exposure is nearly all of one, or 26 ms.
    assert!(u32::from(sensor.settle_ms) * fps >= 6000 - fps, "{}", sensor.name);
    let (exposure, longest) = (exposure(sensor), u32::from(sensor.longest_exposure));
    assert!(exposure <= longest && longest <= lines - 2, "{}: {exposure} of {lines} lines", sensor.name);
    let exposed_ms = f64::from(exposure * clocks) / f64::from(clock);
    assert!(exposed_ms > f64::min(26.0, 900.0 / rate), "{}: {exposed_ms} ms", sensor.name);
}

#[test]
fn every_setting_is_read_back_within_a_second() {
    for sensor in ALL {
        let table: Vec<_> = sensor.settings.iter().copied().flatten().copied().collect();
        let switches = *table.iter().find(|setting| setting.register == sensor.switches).unwrap();
        // Two per frame, and the switches of automatic controls in each. The last frame of a turn may have one or none.
        let mut steps = Vec::new();
        for pair in table.chunks(2) {
            steps.extend(is_read(&sensor, switches));
            steps.extend(pair.iter().flat_map(|setting| is_read(&sensor, *setting)));
        }
        let frames = table.chunks(2).len();
        assert!(frames <= 30, "{}: {frames} frames", sensor.name);
        let (mut bus, mut watch) = (Mock::new(&steps), Watch::default());
        for _ in 0..frames {
            assert_eq!(watch.check(&sensor, &mut bus), Ok(()), "{}", sensor.name);
        }
        bus.done();
        // A changed setting is found in its turn, and the switches at once.
        let mut bus = Mock::new(&is_read(&sensor, Setting { value: 0xE5, ..switches }));
        let error = Watch::default().check(&sensor, &mut bus).unwrap_err();
        let values = RegisterValues { address: sensor.address, found: 0xE5, expected: switches.value };
        assert_eq!(error, SensorError::NotTaken { register: sensor.switches, values });
        bus.done();
    }
}

#[test]
fn a_sensor_rests_with_more_lines_alone() {
    assert!(OMNIVISION.iter().chain([&HM0360]).all(|sensor| sensor.resting().is_none()));
    for sensor in [HM01B0, hm01b0(DataWires::One), hm01b0(DataWires::Four), hm01b0(DataWires::Eight)] {
        let mut resting = sensor;
        let lines = RESTS as u32 * word(&sensor, 0x0340);
        let [high, low] = [(0x0340, lines >> 8), (0x0341, lines & 0xFF)]
            .map(|(register, value)| Setting { register, value: value as u8 });
        let steps: Vec<_> = [high, low].iter().chain(sensor.start).map(|set| is_written(&sensor, *set)).collect();
        let mut bus = Mock::new(&steps);
        assert!(resting.change(sensor.resting().unwrap(), &mut bus));
        bus.done();
        // It keeps its readout and its light.
        assert_eq!((word(&resting, 0x0340), exposure(&resting)), (lines, exposure(&sensor)));
        // What the watch expects is what was written. Back again, two registers change.
        let steps = [high, low].map(|set| Setting { value: at(&sensor, set.register) as u8, ..set });
        let steps: Vec<_> = steps.iter().chain(sensor.start).map(|set| is_written(&sensor, *set)).collect();
        let mut bus = Mock::new(&steps);
        assert!(resting.change(sensor.settings, &mut bus));
        bus.done();
    }
}
