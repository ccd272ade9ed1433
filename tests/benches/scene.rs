//! Measures how long the simulated sensor takes for a frame: first a scene without any effect ("none"), then with one
//! effect at a time, then the default scene. Uneven rubbing is measured together with rubbing. An effect that is off
//! costs nothing.

#![expect(missing_docs, reason = "criterion_group! makes a function without any")]

use std::hint::black_box;
use std::time::{Duration, Instant};

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use wstac_scene::effects::{EFFECTS, bare};
use wstac_scene::sensor::Fidelity;
use wstac_scene::{Scene, SceneConfig};

/// The approximate number of frames from the first touch of a slide at 150 mm/s to its last light.
const FRAMES: u64 = 30;

fn script(fidelity: Fidelity) -> SceneConfig {
    SceneConfig { fidelity, ..SceneConfig::parse_short("Saw3@150,seed=1").expect("a scene") }
}

/// Returns a scene just before its first touch.
fn ready(script: &SceneConfig) -> Scene {
    let mut scene = Scene::new(script).expect("a scene");
    while scene.frame() < scene.truth()[0].start_frame() {
        scene.next_shot();
    }
    scene
}

fn frame(c: &mut Criterion, fidelity: Fidelity, name: &str) {
    let mut group = c.benchmark_group(format!("scene frame {name}"));
    group.throughput(Throughput::Elements(1));
    let none = bare(&script(fidelity));
    let mut one = |name: &str, script: &SceneConfig| {
        let ready = ready(script);
        group.bench_with_input(BenchmarkId::from_parameter(name), &ready, |b, ready| {
            // Reports the time per frame, not the total time.
            b.iter_custom(|rounds| {
                let mut all = Duration::ZERO;
                for _ in 0..rounds {
                    let mut scene = ready.clone();
                    let start = Instant::now();
                    for _ in 0..FRAMES {
                        black_box(scene.next_shot());
                    }
                    all += start.elapsed();
                }
                all / FRAMES as u32
            });
        });
    };
    one("none", &none);
    for effect in &EFFECTS {
        let mut with = none.clone();
        (effect.add)(&mut with);
        // An effect that needs pixels changes the fidelity; then it is not measured here.
        if with.fidelity == fidelity {
            one(effect.name, &with);
        }
    }
    one("default", &script(fidelity));
    group.finish();
}

fn frames(c: &mut Criterion) {
    frame(c, Fidelity::Taxel, "taxel");
    frame(c, Fidelity::Rendered, "rendered");
}

criterion_group!(benches, frames);
criterion_main!(benches);
