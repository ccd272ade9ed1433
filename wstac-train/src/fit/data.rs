//! Labeled slides: the speed of each, and how long it was lit.

use std::path::Path;

use wstac_core::rate::FrameRate;

use crate::model::npz::{Array, Npz};
use wstac_host::error::Error;

/// Largest number of slides in a file, all of which are in memory.
const MOST: u64 = 1 << 20;

/// A slide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Labeled {
    /// Its speed, in mm/s.
    pub speed_mm_s: f64,
    /// Its event's duration, in frames at 30 per second.
    pub frames: f64,
}

/// Slides to which a law is fitted, and the numbers of those left out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Slides {
    /// The slides to which it is fitted.
    pub used: Vec<Labeled>,
    /// Left out: their speed is not known (NaN).
    pub no_speed: usize,
    /// Left out: cut off or never lit (a duration of −1).
    pub no_duration: usize,
    /// Left out: not reliable.
    pub unreliable: usize,
    /// Frames per second of their camera, or `None` before a file is added.
    pub rate: Option<FrameRate>,
}

/// Fraction by which frame rates may differ and still count as equal: 30 and 30000/1001 do.
const RATE_OFF: f64 = 0.01;

impl Slides {
    /// Adds the slides of a file.
    ///
    /// The file has arrays `speed` and `duration`, and optionally `reliable` and `fps`, as `wstac dataset` writes them.
    /// The frames per second are those of `fps`, else those that are `given`, else 30.
    ///
    /// # Errors
    /// An array or element is not valid, or the file's frame length differs from that given or that of the files
    /// before. The message names the array, the element, the value found and the values expected.
    pub fn add(&mut self, path: &Path, given: Option<FrameRate>) -> Result<(), Error> {
        let npz = Npz::open(path)?;
        let rate = rate(&npz, given)?;
        let nominal_frames = f64::from(rate.nominal_frames());
        let first = *self.rate.get_or_insert(rate);
        if (nominal_frames / f64::from(first.nominal_frames()) - 1.0).abs() > RATE_OFF {
            let (found, expected) = (rate.per_second(), first.per_second());
            let message = format_args!("{found} frames per second, expected {expected}, as the files before have");
            return Err(npz.error("fps", message));
        }
        let speeds = numbers(&npz, "speed")?;
        let durations = numbers(&npz, "duration")?;
        let has_reliable = npz.names().any(|name| name == "reliable");
        let reliable = if has_reliable { numbers(&npz, "reliable")? } else { vec![1.0; speeds.len()] };
        for (name, array) in [("duration", &durations), ("reliable", &reliable)] {
            if array.len() != speeds.len() {
                let (found, expected) = (array.len(), speeds.len());
                return Err(npz.error(name, format_args!("has {found} elements, expected {expected} as speed has")));
            }
        }
        for (k, ((&speed_mm_s, &duration), &reliable)) in speeds.iter().zip(&durations).zip(&reliable).enumerate() {
            let wrong =
                |name, found, expected| npz.error(name, format_args!("element {k} is {found}, expected {expected}"));
            if speed_mm_s <= 0.0 || speed_mm_s.is_infinite() {
                return Err(wrong("speed", speed_mm_s, "mm/s above 0, or NaN where it is not known"));
            }
            let is_none = (duration + 1.0).abs() < f64::EPSILON;
            if !(duration.is_finite() && (duration >= 0.0 || is_none)) {
                return Err(wrong("duration", duration, "frames, or -1 where there is none"));
            }
            if speed_mm_s.is_nan() {
                self.no_speed += 1;
            } else if duration < 0.0 {
                self.no_duration += 1;
            } else if reliable == 0.0 {
                self.unreliable += 1;
            } else {
                self.used.push(Labeled { speed_mm_s, frames: duration * nominal_frames });
            }
        }
        Ok(())
    }

    /// Returns the different speeds of the slides that are used, in order.
    pub fn speeds(&self) -> Vec<f64> {
        let mut speeds: Vec<f64> = self.used.iter().map(|slide| slide.speed_mm_s).collect();
        speeds.sort_by(f64::total_cmp);
        speeds.dedup();
        speeds
    }

    /// Returns the number of slides that were left out.
    pub fn left_out(&self) -> usize {
        self.no_speed + self.no_duration + self.unreliable
    }
}

/// Returns the frames per second of a file's camera.
fn rate(npz: &Npz<'_>, given: Option<FrameRate>) -> Result<FrameRate, Error> {
    if !npz.names().any(|name| name == "fps") {
        return Ok(given.unwrap_or(FrameRate::NOMINAL));
    }
    let array = npz.array("fps")?;
    if !array.shape.is_empty() {
        return Err(npz.error("fps", format_args!("shape {:?}, expected no dimension", array.shape)));
    }
    let fps = elements(npz, "fps", array, 1)?.first().copied().unwrap_or(f64::NAN);
    if let Some(given) = given.map(FrameRate::per_second)
        && (given / fps - 1.0).abs() > RATE_OFF
    {
        return Err(npz.error("fps", format_args!("{fps} frames per second, but --fps is {given}: expected the same")));
    }
    // Whole numbers and television's 1001ths are exact; others are rounded to the thousandth.
    let whole = |by: u32| ((fps * f64::from(by)).round() - fps * f64::from(by)).abs() < 1e-6;
    let by = [1, 1001].into_iter().find(|by| whole(*by)).unwrap_or(1000);
    let rate = Some((fps * f64::from(by)).round()).filter(|n| (1.0..=f64::from(u32::MAX)).contains(n));
    let rate = rate.and_then(|numerator| FrameRate::new(numerator as u32, by).ok());
    rate.ok_or_else(|| npz.error("fps", format_args!("{fps}, expected frames per second above 0")))
}

/// Reads an array of one dimension, of any type of numbers.
fn numbers(npz: &Npz<'_>, name: &str) -> Result<Vec<f64>, Error> {
    let array = npz.array(name)?;
    let &[n] = array.shape.as_slice() else {
        return Err(npz.error(name, format_args!("shape {:?}, expected one dimension", array.shape)));
    };
    if n > MOST {
        return Err(npz.error(name, format_args!("has {n} elements, expected at most {MOST}")));
    }
    elements(npz, name, array, n)
}

/// Reads the next `n` elements of an array.
fn elements(npz: &Npz<'_>, name: &str, mut array: Array, n: u64) -> Result<Vec<f64>, Error> {
    macro_rules! of {
        ($kind:ty) => {{
            let mut bytes = [0; size_of::<$kind>()];
            let mut next = || array.read(&mut bytes).map(|()| <$kind>::from_le_bytes(bytes) as f64);
            (0..n).map(|_| next()).collect::<Result<Vec<f64>, _>>()
        }};
    }
    let found = match array.descr.as_str() {
        "<f8" => of!(f64),
        "<f4" => of!(f32),
        "<i8" => of!(i64),
        "<i4" => of!(i32),
        "<i2" => of!(i16),
        "|i1" => of!(i8),
        "|u1" | "|b1" => of!(u8),
        other => return Err(npz.error(name, format_args!("type {other}, expected float64, integers or bool"))),
    };
    found.map_err(|error| npz.error(name, error))
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::path::PathBuf;

    use super::*;
    use crate::dataset::npz::{Dtype, Npz as Writer};

    /// Writes a file of these arrays; `fps` has no dimension.
    fn file(name: &str, arrays: &[(&str, &[f64])]) -> PathBuf {
        let path = std::env::temp_dir().join(format!("wstac-fit-{}-{name}.npz", std::process::id()));
        let mut npz = Writer::new(std::fs::File::create(&path).unwrap());
        for (array, numbers) in arrays {
            let write =
                |out: &mut dyn Write| numbers.iter().try_for_each(|number| out.write_all(&number.to_le_bytes()));
            let shape: &[usize] = if *array == "fps" { &[] } else { &[numbers.len()] };
            npz.array(array, Dtype::Float64, shape, write).unwrap();
        }
        npz.finish().unwrap();
        path
    }

    #[test]
    fn what_is_left_out_is_counted_by_its_reason() {
        let path = file(
            "left-out",
            &[
                ("speed", &[100.0, f64::NAN, 120.0, 130.0, 140.0]),
                ("duration", &[38.0, 37.0, -1.0, 35.0, 33.0]),
                ("reliable", &[1.0, 1.0, 1.0, 0.0, 1.0]),
            ],
        );
        let mut slides = Slides::default();
        slides.add(&path, Some(FrameRate::new(25, 1).unwrap())).unwrap();
        std::fs::remove_file(path).unwrap();
        let used = |speed_mm_s, frames: f64| Labeled { speed_mm_s, frames: frames * f64::from(1.2_f32) };
        assert_eq!(slides.used, [used(100.0, 38.0), used(140.0, 33.0)]);
        assert_eq!((slides.no_speed, slides.no_duration, slides.unreliable, slides.left_out()), (1, 1, 1, 3));
    }

    #[test]
    fn frames_a_second_are_the_files_own_and_nothing_contradicts_them() {
        let rate = |numerator, denominator| FrameRate::new(numerator, denominator).unwrap();
        let with = |name: &str, fps: Option<f64>| {
            let fps: Vec<f64> = fps.into_iter().collect();
            let mut arrays = vec![("speed", &[100.0][..]), ("duration", &[38.0][..])];
            arrays.extend((!fps.is_empty()).then_some(("fps", &fps[..])));
            file(name, &arrays)
        };
        for (name, fps, given, expected) in [
            ("none", None, None, Ok(rate(30, 1))),
            ("given", None, Some(rate(40, 1)), Ok(rate(40, 1))),
            ("own", Some(40.0), None, Ok(rate(40, 1))),
            ("television", Some(30_000.0 / 1001.0), Some(rate(30, 1)), Ok(rate(30_000, 1001))),
            ("odd", Some(12.345), None, Ok(rate(12_345, 1000))),
            ("against", Some(40.0), Some(rate(30, 1)), Err("array fps: 40 frames per second, but --fps is 30")),
            ("zero", Some(0.0), None, Err("array fps: 0, expected frames per second above 0")),
            ("nan", Some(f64::NAN), None, Err("array fps: NaN, expected")),
        ] {
            let (path, mut slides) = (with(&format!("fps-{name}"), fps), Slides::default());
            let added = slides.add(&path, given);
            std::fs::remove_file(path).unwrap();
            match expected {
                Ok(rate) => {
                    added.unwrap();
                    assert_eq!(slides.rate, Some(rate), "{name}");
                    let frames = 38.0 * f64::from(rate.nominal_frames());
                    assert_eq!(slides.used, [Labeled { speed_mm_s: 100.0, frames }], "{name}");
                }
                Err(part) => assert!(added.unwrap_err().to_string().contains(part), "{name}"),
            }
        }
        let (slow, fast) = (with("fps-slow", Some(20.0)), with("fps-fast", Some(30.0)));
        let mut slides = Slides::default();
        slides.add(&slow, None).unwrap();
        let error = slides.add(&fast, None).unwrap_err().to_string();
        for path in [slow, fast] {
            std::fs::remove_file(path).unwrap();
        }
        assert!(error.contains("30 frames per second, expected 20, as the files before have"), "{error}");
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (name, arrays, parts) in [
            ("no-speed", vec![("duration", &[1.0][..])], ["array speed", "missing, found duration"]),
            (
                "short",
                vec![("speed", &[1.0, 2.0][..]), ("duration", &[1.0][..])],
                ["array duration", "has 1 elements, expected 2"],
            ),
            (
                "negative",
                vec![("speed", &[1.0, -2.0][..]), ("duration", &[1.0, 1.0][..])],
                ["array speed", "element 1 is -2"],
            ),
            (
                "infinite",
                vec![("speed", &[f64::INFINITY][..]), ("duration", &[1.0][..])],
                ["array speed", "element 0 is inf"],
            ),
            ("nan", vec![("speed", &[1.0][..]), ("duration", &[f64::NAN][..])], ["array duration", "element 0 is NaN"]),
            ("minus", vec![("speed", &[1.0][..]), ("duration", &[-2.0][..])], ["array duration", "element 0 is -2"]),
        ] {
            let path = file(name, &arrays);
            let message = Slides::default().add(&path, None).unwrap_err().to_string();
            std::fs::remove_file(path).unwrap();
            for part in parts {
                assert!(message.contains(part), "{name} gave {message:?}, expected {part:?}");
            }
        }
    }
}
