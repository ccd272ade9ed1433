//! Tests every step on the bus, in order, and every way in which a step can fail.

use std::string::ToString;
use std::vec::Vec;

use embedded_hal::i2c::{ErrorKind, NoAcknowledgeSource};
use embedded_hal_mock::eh1::delay::NoopDelay;
use embedded_hal_mock::eh1::i2c::{Mock, Transaction};

use super::ov7690::OV7690;
use super::ov7692::OV7692;
use super::ov7725::OV7725;
use super::watch::Watch;
use super::{LONGEST_EXPOSURE, Sensor, SensorError, Setting, set};

const ALL: [Sensor; 3] = [OV7690, OV7692, OV7725];

fn is_read(sensor: &Sensor, Setting { register, value }: Setting) -> [Transaction; 2] {
    // A stop lies between the two: each transaction of the mock stands alone.
    [Transaction::write(sensor.address, [register].into()), Transaction::read(sensor.address, [value].into())]
}

fn is_written(sensor: &Sensor, Setting { register, value }: Setting) -> Transaction {
    Transaction::write(sensor.address, [register, value].into())
}

fn settings(sensor: &Sensor) -> Vec<Setting> {
    sensor.banked.iter().chain(sensor.settings.iter().copied().flatten()).copied().collect()
}

/// Returns all steps on the bus if nothing is wrong.
fn whole(sensor: &Sensor) -> Vec<Transaction> {
    let mut steps: Vec<_> = sensor.identity.into_iter().flat_map(|setting| is_read(sensor, setting)).collect();
    steps.push(is_written(sensor, sensor.reset));
    for setting in settings(sensor) {
        steps.push(is_written(sensor, setting));
        steps.extend(is_read(sensor, setting));
    }
    steps
}

/// Sets the sensor up over a bus that expects these steps and no others.
fn set_up(sensor: &Sensor, steps: &[Transaction]) -> Result<(), SensorError<ErrorKind>> {
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
    let mut steps = Vec::from(is_read(&OV7725, OV7690.identity[0]));
    steps.extend(is_read(&OV7725, OV7690.identity[1]));
    let error = set_up(&OV7725, &steps).unwrap_err();
    assert_eq!(error, SensorError::Identity { found: 0x7691, expected: 0x7721 });
    assert_eq!(error.to_string(), "the sensor is 0x7691, expected 0x7721");
}

#[test]
fn no_acknowledge_at_any_step_ends_it_there_and_names_the_register() {
    let error = ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address);
    for sensor in ALL {
        let steps = whole(&sensor);
        for at in 0..steps.len() {
            let mut steps = steps[..=at].to_vec();
            steps[at] = steps[at].clone().with_error(error);
            let Err(SensorError::Bus { register, error: found }) = set_up(&sensor, &steps) else {
                panic!("{}, step {at}: no error", sensor.name)
            };
            assert_eq!(found, error);
            // The identity takes four steps, the reset one, and each setting three.
            let expected = match at {
                0..4 => sensor.identity[at / 2].register,
                4 => sensor.reset.register,
                _ => settings(&sensor)[(at - 5) / 3].register,
            };
            assert_eq!(register, expected, "{}, step {at}", sensor.name);
        }
    }
}

#[test]
fn a_setting_that_is_not_taken_is_named() {
    for sensor in ALL {
        for (k, setting) in settings(&sensor).into_iter().enumerate() {
            let mut steps = whole(&sensor);
            steps.truncate(5 + 3 * k + 3);
            let found = setting.value ^ 1;
            steps[5 + 3 * k + 2] = Transaction::read(sensor.address, [found].into());
            let error = SensorError::NotTaken { register: setting.register, found, expected: setting.value };
            assert_eq!(set_up(&sensor, &steps), Err(error), "{}", sensor.name);
        }
    }
}

#[test]
fn automatic_controls_are_off_before_their_values_are_set() {
    for sensor in ALL {
        let settings: Vec<_> = sensor.settings.iter().copied().flatten().copied().collect();
        let place = |register| settings.iter().position(|setting| setting.register == register).unwrap();
        // 0x13 holds the switches of all three in both families. Gain, blue, red, green, and exposure's low byte
        // follow.
        assert_eq!(settings[place(0x13)].value & 7, 0, "{}", sensor.name);
        assert!([0x00, 0x01, 0x02, 0x03, 0x10].into_iter().all(|value| place(value) > place(0x13)), "{}", sensor.name);
        // No setting resets it again, and none is undone by a later one.
        for (k, setting) in settings.iter().enumerate() {
            assert_ne!(*setting, sensor.reset);
            assert_eq!(place(setting.register), k, "{}: {:#04x} twice", sensor.name, setting.register);
        }
    }
}

#[test]
fn a_clock_that_is_too_fast_is_divided_once() {
    for sensor in ALL {
        let mut slow = sensor;
        assert!(!slow.slow_down(1) && !slow.slow_down(3) && slow.slow_down(2) && !slow.slow_down(4), "{}", sensor.name);
        let changed: Vec<_> = sensor.table().zip(slow.table()).filter(|(before, after)| before != after).collect();
        let [(before, after)] = changed[..] else { panic!("{changed:?}") };
        assert_eq!((before.register, after.register, after.value), (0x11, 0x11, sensor.slower[0]));
        // The divider is 1 plus the register, which the OV7725 doubles.
        assert_eq!(u32::from(after.value) + 1, 2 * (u32::from(before.value) + 1), "{}", sensor.name);
        assert_eq!(u32::from(sensor.slower[1]) + 1, 4 * (u32::from(before.value) + 1), "{}", sensor.name);
    }
}

#[test]
fn another_exposure_changes_its_two_registers_alone() {
    for sensor in ALL {
        let [high, low] = sensor.exposure;
        let longer = Sensor { lines: Some(LONGEST_EXPOSURE), ..sensor };
        let changed: Vec<_> = sensor.table().zip(longer.table()).filter(|(before, after)| before != after).collect();
        // The high byte is that of 480 lines already.
        let [(before, after)] = changed[..] else { panic!("{changed:?}") };
        assert_eq!((before.register, after), (low, set(low, 0xF4)), "{}", sensor.name);
        let short: Vec<_> = Sensor { lines: Some(100), ..sensor }.table().collect();
        assert!(short.contains(&set(high, 0)) && short.contains(&set(low, 100)), "{}", sensor.name);
    }
}

#[test]
fn every_setting_is_read_back_within_a_second() {
    for sensor in ALL {
        let table: Vec<_> = sensor.settings.iter().copied().flatten().copied().collect();
        let switches = *table.iter().find(|setting| setting.register == 0x13).unwrap();
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
        let [address, _] = is_read(&sensor, switches);
        let mut bus = Mock::new(&[address, Transaction::read(sensor.address, [0xE5].into())]);
        let error = Watch::default().check(&sensor, &mut bus).unwrap_err();
        assert_eq!(error, SensorError::NotTaken { register: 0x13, found: 0xE5, expected: 0 });
        bus.done();
    }
}
