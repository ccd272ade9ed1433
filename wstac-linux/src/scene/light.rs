//! Light of a whisker's base: flashes with the rate of strain, glows while it is rubbed, fades exponentially.

use libm::exp;

/// Afterglow: the time in s in which light fades to 1/e (fitted to the speed law together with [`FLASH`]).
pub const AFTERGLOW_S: f64 = 0.055;
/// Light of bending by a strain of 1, in shares of full scale · s (fitted with [`AFTERGLOW_S`]).
pub const FLASH: f64 = 0.022;
/// Light of rubbing over a mm at a strain of 1, in shares of full scale · s: friction goes with the force that
/// bends (a guess).
pub const RUBBING: f64 = 0.000_8;

/// The steps that time goes in, all of one length.
#[derive(Clone, Copy, Debug)]
pub struct Steps {
    /// Length in s.
    seconds: f64,
    /// What is left of the light after a step.
    fading: f64,
}

impl Steps {
    /// Steps of this length in s, above 0.
    pub fn new(seconds: f64) -> Self {
        Self { seconds, fading: exp(-seconds / AFTERGLOW_S) }
    }
}

/// The light of one whisker.
#[derive(Clone, Copy, Debug, Default)]
pub struct Light {
    /// Brightness now, as a share of full scale.
    brightness: f64,
    /// Strain now.
    strain: f64,
}

impl Light {
    /// Goes on by a step, at the end of which the base is strained by `strain` and over which the surface has slid
    /// by `slid_mm` mm. Returns the exposure: the brightness integrated over the step, in shares of full scale · s.
    pub fn step(&mut self, steps: Steps, strain: f64, slid_mm: f64) -> f64 {
        // Only the change matters, not how it is spread within a step: a sudden release needs no smaller steps.
        let flash = FLASH * libm::fabs(strain - self.strain);
        let emitted = flash + RUBBING * strain * slid_mm;
        self.strain = strain;
        // τ · dB/dt = rate − B, solved for a rate that is even over the step; its integral is the exposure.
        let rate = emitted / steps.seconds;
        let before = self.brightness;
        self.brightness = before * steps.fading + rate * (1.0 - steps.fading);
        emitted - AFTERGLOW_S * (self.brightness - before)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_that_is_emitted_is_seen_whatever_the_step() {
        for seconds in [1e-4, 1e-3, 1e-2] {
            let (steps, mut light) = (Steps::new(seconds), Light::default());
            let mut seen = light.step(steps, 0.2, 0.0);
            for _ in 0..(2.0 / seconds) as u32 {
                seen += light.step(steps, 0.2, 0.0);
            }
            assert!((seen - 0.2 * FLASH).abs() < 1e-12, "{seconds}: {seen}");
        }
    }

    #[test]
    fn still_is_silent() {
        let (steps, mut light) = (Steps::new(1e-3), Light::default());
        light.step(steps, 0.2, 0.0);
        for _ in 0..2000 {
            light.step(steps, 0.2, 0.0);
        }
        assert!(light.brightness < 1e-12);
        assert!(light.step(steps, 0.2, 1.0) > 0.0);
    }
}
