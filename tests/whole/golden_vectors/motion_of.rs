//! The reference's answer about a motion, of an event or of a frame.

use serde::Deserialize;
use wstac_core::touch::motion::{Contact, Velocity};

/// A motion as the reference has it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MotionOf {
    contact: String,
    mm_s: Option<f64>,
    mm_s_sd: Option<f64>,
    deg: Option<f64>,
    deg_sd: Option<f64>,
    /// Only events have these two.
    pub(super) coherence: Option<f64>,
    pub(super) reliable: Option<bool>,
}

/// How far a velocity may be from that of the reference.
pub(super) struct Tolerance {
    /// Of the speed, as a fraction; at more than 600 mm/s of one that is as much larger if `grows`.
    pub(super) speed: f64,
    pub(super) grows: bool,
    pub(super) degrees: f64,
    /// Of the standard deviations, as a fraction of them, beside this fraction of the speed and these degrees.
    pub(super) deviation: f64,
    pub(super) of_speed: f64,
    pub(super) of_degrees: f64,
}

impl MotionOf {
    /// Checks a motion, and returns how far its speed is off, as a fraction; `None` if nothing slides.
    pub(super) fn check(
        &self,
        at: &str,
        contact: Contact,
        velocity: Option<Velocity>,
        most: &Tolerance,
    ) -> Option<f64> {
        let about = format!("{at}: {velocity:?}, expected {self:?}");
        assert_eq!(contact.as_str(), self.contact, "{about}");
        let (Some(velocity), Some(mm_s)) = (velocity, self.mm_s) else {
            assert!(velocity.is_none() && self.mm_s.is_none(), "{about}");
            return None;
        };
        let off = (f64::from(velocity.mm_s) / mm_s - 1.0).abs();
        let turned = (f64::from(velocity.degrees) - self.deg.unwrap() + 180.0).rem_euclid(360.0) - 180.0;
        let most_off = most.speed * if most.grows { (mm_s / 600.0).max(1.0) } else { 1.0 };
        assert!(off < most_off, "{about}");
        assert!(turned.abs() < most.degrees, "{about}");
        let close = |found: f32, expected: f64, unit: f64| {
            (f64::from(found) - expected).abs() < most.deviation * expected + unit
        };
        assert!(close(velocity.mm_s_sd, self.mm_s_sd.unwrap(), most.of_speed * mm_s), "{about}");
        assert!(close(velocity.degrees_sd, self.deg_sd.unwrap(), most.of_degrees), "{about}");
        Some(off)
    }
}
