//! The matrix of cross-talk: as the scenes have it, and as `wstac calibrate --crosstalk` measures it.

use std::sync::OnceLock;

use wstac_core::touch::crosstalk::Correction;
use wstac_host::config::Config;
use wstac_host::source::{Source, SourceEvent};
use wstac_scene::SceneConfig;
use wstac_scene::source::SceneSource;
use wstac_setup::crosstalk::CrosstalkWatch;

use super::scenes::{CROSSTALK, Fault};

/// Returns the correction that a fault's estimator has.
pub(super) fn correction(fault: Fault) -> Option<Correction> {
    static MEASURED: OnceLock<Correction> = OnceLock::new();
    match fault {
        Fault::KnownCrosstalk => Some(of_matrix(&known())),
        Fault::MeasuredCrosstalk => Some(*MEASURED.get_or_init(|| of_matrix(&measured()))),
        _ => None,
    }
}

fn of_matrix(matrix: &[[f64; 25]; 25]) -> Correction {
    let config = Config::parse(&format!("[layout]\ncrosstalk = {matrix:?}")).expect("the matrix is one of cross-talk");
    config.layout.correction().expect("the configuration has one")
}

/// Returns the matrix of the scenes: each of the four beside a whisker sees the same.
fn known() -> [[f64; 25]; 25] {
    let far = |a: usize, b: usize| (a / 5).abs_diff(b / 5) + (a % 5).abs_diff(b % 5);
    core::array::from_fn(|taxel| core::array::from_fn(|whisker| [1.0, CROSSTALK, 0.0][far(taxel, whisker).min(2)]))
}

/// Pokes each whisker of one sensor, whose gains are not those of the touches.
fn measured() -> [[f64; 25]; 25] {
    let poke = |at: usize| format!("[[touch]]\nkind = \"poke\"\nwhisker = [{}, {}]\n", at / 5 + 1, at % 5 + 1);
    let text = format!(
        "gap = 10\nfidelity = \"taxel\"\n[light]\ncrosstalk = {CROSSTALK}\nunit = 1\n[sensor]\nsize = [400, 400]\n{}",
        (0..25).map(poke).collect::<String>()
    );
    let script = SceneConfig::from_toml("pokes", &text).expect("the scene is right");
    let mut source = SceneSource::new(&script).expect("the scene was read");
    let geometry = Config::default().geometry(source.info()).expect("the layout is the paper's");
    let mut watch = CrosstalkWatch::new(geometry);
    loop {
        match source.next_event().expect("a scene has no errors") {
            SourceEvent::End => break,
            event => _ = watch.take(&event),
        }
    }
    watch.crosstalk().expect("each whisker was poked").matrix
}
