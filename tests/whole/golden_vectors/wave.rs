//! Tests the motion by a wave of the reference's touches: velocities, deviations, what they are known by, and refusals.

use serde::Deserialize;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::params::TAXELS;
use wstac_core::rate::FrameRate;
use wstac_core::reason::Reason;
use wstac_core::touch::motion::{Contact, MotionConfig, Readout, ReadoutTime, RowOrder};
use wstac_core::touch::wave::{Basis, Wave};

use super::case::{directory, read};

#[derive(Deserialize)]
struct Cases {
    cases: Vec<WaveCase>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WaveCase {
    name: String,
    fps: f32,
    readout_ms: Option<f32>,
    sums: Vec<Option<[u16; TAXELS]>>,
    wave: WaveOf,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct WaveOf {
    why: Option<String>,
    mm_s: Option<f64>,
    mm_s_sd: Option<f64>,
    deg: Option<f64>,
    deg_sd: Option<f64>,
    basis: Option<String>,
}

/// Returns the reference's word for a reason.
fn word(reason: Reason) -> &'static str {
    match reason {
        Reason::FewWhiskers => "too few whiskers",
        Reason::NoSlide(Contact::Poke) => "poke",
        Reason::NoSlide(Contact::Press) => "press",
        Reason::NotCrossed => "starts on the sensor",
        Reason::NotOver => "not over",
        Reason::NotAlike => "not alike",
        Reason::SpeedChanges => "speed changed",
        Reason::Turning => "turning",
        Reason::TwoObjects => "two objects",
        Reason::Uncertain => "uncertain",
        Reason::TooSlow => "too slow",
        Reason::TooFast => "too fast",
        Reason::ReadoutUnknown => "readout unknown",
        _ => "another reason",
    }
}

/// Lines have 12 bits, slopes and gains 8 to 12: SPEC §9 has these bounds.
#[test]
fn every_wave_is_that_of_the_reference() {
    let Cases { cases } = read(&directory().join("wave.json"));
    assert!(cases.len() >= 30, "{} cases", cases.len());
    let layout = Layout::paper(FrameSize::new(400, 400).unwrap()).unwrap();
    let (mut wave, mut worst) = (Wave::EMPTY, [0.0_f64; 2]);
    for WaveCase { name, fps, readout_ms, sums, wave: expected } in &cases {
        let rate = FrameRate::new(*fps as u32, 1).unwrap();
        let readout = Readout::of_layout(readout_ms.and_then(ReadoutTime::from_ms), RowOrder::Down, &layout, rate);
        let config = MotionConfig::published(rate).with_readout(readout);
        let found = wave.fit(sums.iter().map(Option::as_ref), config);
        let (Ok((velocity, basis)), Some(mm_s)) = (found, expected.mm_s) else {
            assert_eq!(found.err().map(word), expected.why.as_deref(), "{name}: {found:?}, expected {expected:?}");
            continue;
        };
        let word = if basis == Basis::Edge { "edge" } else { "outline" };
        assert_eq!(Some(word), expected.basis.as_deref(), "{name}: {found:?}");
        let off = (f64::from(velocity.mm_s) / mm_s - 1.0).abs();
        let turned = (f64::from(velocity.degrees) - expected.deg.unwrap() + 180.0).rem_euclid(360.0) - 180.0;
        worst = [worst[0].max(off), worst[1].max(turned.abs())];
        assert!(off < 1e-3 && turned.abs() < 0.15, "{name}: {found:?}, expected {expected:?}");
        let deviations = [velocity.mm_s_sd, velocity.degrees_sd].map(f64::from);
        let (sd, degrees_sd) = (expected.mm_s_sd.unwrap(), expected.deg_sd.unwrap());
        assert!((deviations[0] - sd).abs() < 0.05 * sd + 5e-4 * mm_s, "{name}: {found:?}, expected {expected:?}");
        assert!(
            (deviations[1] - degrees_sd).abs() < 0.05 * degrees_sd + 0.1,
            "{name}: {found:?}, expected {expected:?}"
        );
    }
    println!("{} waves, off by at most {:.4} % and {:.4}°", cases.len(), 100.0 * worst[0], worst[1]);
}
