//! Computes the strain along one whisker while a specimen passes: the paper's figure 2c.

use wstac_core::params::TAXELS;

use super::script::SceneConfig;
use super::surface::Surface;
use super::touch::Touch;

/// The state of a whisker at one moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Moment {
    /// Time since the specimen's leading end reached the whisker, in s.
    pub time_s: f64,
    /// Overlap of the specimen with the tip, in mm.
    pub overlap_mm: f64,
    /// Lateral deflection of the tip, in mm.
    pub deflection_mm: f64,
    /// Strain of the surface, d/2 off the axis, at even distances from the base to the tip.
    pub strain: Vec<f64>,
}

/// Returns the state of the middle whisker at `moments` + 1 even moments of a scene's first slide.
///
/// Each state holds the strain at `parts` + 1 places. The whisker is bent as the surface requires: the spring-back is
/// left out.
pub fn strain_along(script: &SceneConfig, moments: usize, parts: usize) -> Vec<Moment> {
    let Some(slide) = script.touches.iter().find_map(Touch::slide) else { return Vec::new() };
    let whisker = &script.whisker;
    let Some(middle) = whisker.whiskers()[TAXELS / 2] else { return Vec::new() };
    let surface = Surface::new(&slide.specimen, whisker.overlap_mm);
    let length = surface.length_mm();
    let moments = moments.max(1);
    let at = |moment: usize| {
        let passed = length * moment as f64 / moments as f64;
        // The last place is the end of the last segment.
        let segment = surface.segments_from(passed).first().or(surface.segments().last());
        let overlap_mm = segment.map_or(0.0, |s| whisker.overlap_mm - middle.lowered - s.drop_mm(passed)).max(0.0);
        let bend = whisker.beam.shortened((overlap_mm / whisker.length_mm).min(whisker.beam.most_shortening()));
        let strain_of = whisker.diameter_mm / 2.0 / whisker.length_mm;
        Moment {
            time_s: slide.time_s(passed / slide.normal_share()),
            overlap_mm,
            deflection_mm: bend.deflection * whisker.length_mm,
            strain: whisker.beam.curvature_along(&bend, parts).iter().map(|k| k * strain_of).collect(),
        }
    };
    (0..=moments).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks the paper's figure 2c: a sphere of 0.5 mm slides over one whisker at 0.1 m/s, and strain peaks at the
    /// base.
    #[test]
    fn strain_of_a_single_whisker_peaks_at_the_base() {
        for beam in ["linear", "elastica"] {
            let whisker = format!("[whisker]\npresent = \"middle\"\noverlap_mm = 0.4\nbeam = \"{beam}\"");
            let text = format!("specimen = \"Sphere\"\nspeed = 100\n{whisker}");
            let script = SceneConfig::from_toml("figure 2c", &text).unwrap();
            let moments = strain_along(&script, 20, 10);
            assert_eq!((moments.len(), moments[0].strain.len()), (21, 11));
            for moment in &moments {
                let peak = moment.strain.iter().fold(0.0_f64, |a, &b| a.max(b));
                assert!((peak - moment.strain[0]).abs() < 1e-12, "{moment:?}");
                assert!(moment.strain[10] < 1e-4, "{moment:?}");
            }
            // The strain is highest in the middle of the pass, 5 ms after the first touch. It is zero at the ends of
            // the pass.
            let peaks: Vec<f64> = moments.iter().map(|moment| moment.strain[0]).collect();
            assert!(peaks.iter().all(|peak| *peak <= peaks[10]) && peaks[10] > 0.05, "{peaks:?}");
            assert!(peaks[0] < 1e-9 && peaks[20] < 1e-9, "{peaks:?}");
            assert!((moments[10].time_s - 0.005).abs() < 1e-12);
            // The tip of a whisker that is 0.4 mm shorter is deflected by 1.8 mm.
            assert!((moments[10].deflection_mm - 1.8).abs() < 0.1, "{}", moments[10].deflection_mm);
        }
    }
}
