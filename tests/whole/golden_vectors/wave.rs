//! Tests the motion by a wave of the reference's touches: velocities, deviations, what they are known by, and refusals;
//! and what live motion by 25 taxels says of them frame by frame.

use serde::Deserialize;
use wstac_core::green::gray::Gray;
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::params::TAXELS;
use wstac_core::pipeline::Pipeline;
use wstac_core::rate::FrameRate;
use wstac_core::reason::Reason;
use wstac_core::taxels::FrameGeometry;
use wstac_core::touch::motion::{
    Contact, LiveContact, LiveWave, MotionConfig, Readout, ReadoutTime, RowOrder, Velocity,
};
use wstac_core::touch::taxel_ring::TaxelRing;
use wstac_core::touch::wave::{Basis, Measured, Wave};

use super::case::{Cases, directory, read};
use super::live::MOST;
use super::motion_of::MotionOf;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WaveCase {
    name: String,
    fps: f32,
    readout_ms: Option<f32>,
    sums: Vec<Option<[u16; TAXELS]>>,
    wave: WaveOf,
    /// Each frame with a live velocity, and what that is known by.
    live: Vec<(usize, MotionOf, String)>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WaveOf {
    pub(super) why: Option<String>,
    pub(super) mm_s: Option<f64>,
    mm_s_sd: Option<f64>,
    deg: Option<f64>,
    deg_sd: Option<f64>,
    basis: Option<String>,
    #[serde(default)]
    mm_s2: Option<f64>,
    #[serde(default)]
    mm_s2_sd: Option<f64>,
}

/// Returns the reference's word for a reason.
pub(super) fn word(reason: Reason) -> &'static str {
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

/// Sums of a taxel before a case's frames, and frames until the baseline is known.
pub(super) const DARK: u32 = 300;
const BEFORE: usize = 70;

pub(super) fn config(readout_ms: Option<f32>, fps: f32, layout: &Layout) -> MotionConfig {
    let rate = FrameRate::new(fps as u32, 1).unwrap();
    let time = readout_ms.and_then(ReadoutTime::from_ms);
    MotionConfig::published(rate).with_readout(Readout::of_layout(time, RowOrder::Down, layout, rate))
}

impl WaveCase {
    fn config(&self, layout: &Layout) -> MotionConfig {
        config(self.readout_ms, self.fps, layout)
    }

    /// Returns each frame with a live velocity.
    fn live(&self, layout: Layout) -> Vec<(usize, LiveContact)> {
        let config = self.config(&layout);
        let geometry = FrameGeometry::new(Gray, layout, FrameRate::NOMINAL).unwrap();
        let mut pipeline = Pipeline::builder(geometry).taxels::<TaxelRing>().build().unwrap();
        let (mut live, mut said) = (LiveWave::new(config), Vec::new());
        let dark = [Some([DARK as u16; TAXELS]); BEFORE];
        for (frame, sums) in dark.iter().chain(&self.sums).enumerate() {
            let Some(sums) = sums else {
                pipeline.push_lost(1);
                continue;
            };
            pipeline.push_taxels(&sums.map(u32::from));
            let (next_frame, recent) = pipeline.recent();
            let Some(baseline) = pipeline.baseline() else { continue };
            let answer = live.push(next_frame, recent, baseline, pipeline.taxel_ring());
            said.extend(answer.filter(|touch| touch.velocity.is_some()).map(|touch| (frame - BEFORE, touch)));
        }
        said
    }
}

/// Returns a layout whose taxels have 256 pixels.
pub(super) fn layout() -> Layout {
    let corners = core::array::from_fn(|taxel| [16 * (taxel % 5) as u16, 16 * (taxel / 5) as u16]);
    Layout::new(FrameSize::new(80, 80).unwrap(), [16, 16], corners).unwrap()
}

/// Checks that every bit is as recorded. Boards are compared with the same record (`ci/firmware`). A change of the
/// record is a change of answers.
#[test]
fn every_processor_says_the_same_live() {
    let Cases::<WaveCase> { cases } = read(&directory().join("wave.json"));
    let mut found = String::new();
    for case in &cases {
        for (frame, touch) in case.live(layout()) {
            let Velocity { mm_s, mm_s_sd, degrees, degrees_sd, .. } = touch.velocity.unwrap();
            let head = [(BEFORE + frame) as u16, u16::from(touch.basis == Some(Basis::Edge))].map(u16::to_le_bytes);
            let bits = [mm_s, mm_s_sd, degrees, degrees_sd].map(f32::to_le_bytes);
            found.extend(head.as_flattened().iter().chain(bits.as_flattened()).map(|byte| format!("{byte:02x}")));
        }
        found += "ffff\n";
    }
    let recorded = std::fs::read_to_string(directory().with_file_name("firmware").join("velocities.txt")).unwrap();
    assert!(found == recorded, "expected the bits of tests/firmware/velocities.txt, found:\n{found}");
}

#[test]
fn every_live_velocity_is_that_of_the_reference() {
    let Cases::<WaveCase> { cases } = read(&directory().join("wave.json"));
    let (mut velocities, mut worst) = (0, 0.0_f64);
    for case in &cases {
        let found = case.live(layout());
        let frames = |said: &[usize]| format!("{}: {said:?}", case.name);
        let [here, there] =
            [found.iter().map(|said| said.0).collect::<Vec<_>>(), case.live.iter().map(|said| said.0).collect()];
        assert_eq!(frames(&here), frames(&there));
        for ((_, touch), (frame, expected, basis)) in found.iter().zip(&case.live) {
            let at = format!("{}, frame {frame}", case.name);
            assert_eq!(touch.basis.map(Basis::as_str), Some(&basis[..]), "{at}");
            worst = worst.max(expected.check(&at, touch.contact, touch.velocity, &MOST).unwrap());
            velocities += 1;
        }
    }
    assert!(velocities >= 60, "{velocities} velocities");
    println!("{velocities} live velocities, speeds off by at most {:.3} %", 100.0 * worst);
}

/// Checks a velocity, and returns how far its speed is off, as a fraction, and its direction in degrees.
///
/// Lines have 12 bits, slopes and gains 8 to 12: SPEC §9 has these bounds.
pub(super) fn check_velocity(at: &str, found: Velocity, basis: Option<Basis>, expected: &WaveOf) -> [f64; 2] {
    let Velocity { mm_s, mm_s_sd, degrees, degrees_sd, .. } = found;
    let about = format!("{at}: {found:?}, {basis:?}, expected {expected:?}");
    assert_eq!(basis.map(Basis::as_str), expected.basis.as_deref(), "{about}");
    let expected_mm_s = expected.mm_s.unwrap();
    let off = (f64::from(mm_s) / expected_mm_s - 1.0).abs();
    let turned = (f64::from(degrees) - expected.deg.unwrap() + 180.0).rem_euclid(360.0) - 180.0;
    assert!(off < 1e-3 && turned.abs() < 0.15, "{about}");
    let (sd, deg_sd) = (expected.mm_s_sd.unwrap(), expected.deg_sd.unwrap());
    assert!((f64::from(mm_s_sd) - sd).abs() < 0.05 * sd + 5e-4 * expected_mm_s, "{about}");
    assert!((f64::from(degrees_sd) - deg_sd).abs() < 0.05 * deg_sd + 0.1, "{about}");
    [off, turned.abs()]
}

#[test]
fn every_wave_is_that_of_the_reference() {
    let Cases::<WaveCase> { cases } = read(&directory().join("wave.json"));
    assert!(cases.len() >= 30, "{} cases", cases.len());
    let layout = layout();
    let (mut wave, mut worst) = (Wave::EMPTY, [0.0_f64; 2]);
    for case in &cases {
        let WaveCase { name, sums, wave: expected, .. } = case;
        let found = wave.fit(sums.iter().map(Option::as_ref), case.config(&layout));
        let (Ok((velocity, basis)), Some(_)) = (found, expected.mm_s) else {
            assert_eq!(found.err().map(word), expected.why.as_deref(), "{name}: {found:?}, expected {expected:?}");
            continue;
        };
        let off = check_velocity(name, velocity, Some(basis), expected);
        worst = [worst[0].max(off[0]), worst[1].max(off[1])];
        let acceleration = wave.acceleration().map(|Measured { value, sd }| [value, sd].map(f64::from));
        assert_eq!(acceleration.is_some(), expected.mm_s2.is_some(), "{name}: {found:?}, expected {expected:?}");
        if let (Some(found), Some(of), Some(of_sd)) = (acceleration, expected.mm_s2, expected.mm_s2_sd) {
            let off = [(found[0] - of).abs(), (found[1] - of_sd).abs()];
            assert!(off[0] < 0.4 * of_sd && off[1] < 0.2 * of_sd, "{name}: {found:?}, expected {expected:?}");
        }
    }
    println!("{} waves, off by at most {:.4} % and {:.4}°", cases.len(), 100.0 * worst[0], worst[1]);
}
