//! Reads any text as a scene, a sweep and a plan. The result is an error of one short line, or a scene whose first
//! frames come in time.
#![no_main]

use libfuzzer_sys::fuzz_target;
use wstac_host::visible;
use wstac_scene::sensor::Fidelity;
use wstac_scene::{Scene, SceneConfig};
use wstac_train::dataset::sweep::Sweep;

fuzz_target!(|text: &str| {
    let check = |error: wstac_host::error::Error| {
        let text = error.to_string();
        assert!(text.len() <= visible::LONGEST && !text.contains(char::is_control), "{text:?}");
    };
    if let Err(error) = Sweep::parse("fuzz", text) {
        check(error);
    }
    let script = match SceneConfig::from_toml("fuzz", text) {
        Ok(script) => SceneConfig { fidelity: Fidelity::Taxel, ..script },
        Err(error) => return check(error),
    };
    match Scene::new(&script) {
        Err(error) => check(error),
        Ok(mut scene) => {
            for _ in 0..3 {
                scene.next_shot();
            }
        }
    }
});
