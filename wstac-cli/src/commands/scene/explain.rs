//! `wstac scene explain` prints what a scene models, what it does not, and what each effect costs.

use std::ffi::OsString;
use std::io::Write;
use std::time::{Duration, Instant};

use super::super::output::{Stop, Visible, note, stdout};
use super::named;
use wstac_host::error::Error;
use wstac_host::source::open::OpenOptions;
use wstac_scene::effects::{EFFECTS, Effect, NEVER};
use wstac_scene::sensor::Fidelity;
use wstac_scene::source::script;
use wstac_scene::{Scene, SceneConfig, Truth};

/// Print what a scene models, and what each effect costs
///
/// Costs are in ns per frame. The cost of an effect is by how much a frame of the scene takes longer with it than
/// without it, measured on this machine now. The command also prints what is not modeled.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Saw3@150[,90deg][,60mm][,seed=N], or FILE.toml
    scene: OsString,

    /// Do not measure what effects cost
    #[arg(long)]
    no_cost: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let script = script(named(&arguments.scene), &OpenOptions::default())?;
    let scene = Scene::new(&script).map_err(|error| error.about(arguments.scene.display()))?;
    let mut out = stdout();
    let (width, height) = script.sensor.size.into();
    let rate = script.sensor.rate.per_second();
    let kind = if script.fidelity == Fidelity::Taxel { "taxel sums only" } else { "rendered" };
    writeln!(out, "{} frames of {width}x{height} at {rate} per second, {kind}", scene.frames())?;
    for truth in scene.truth() {
        let (from, to) = (truth.start_s * rate, truth.end_s * rate);
        writeln!(out, "  {}: frames {from:.1} to {to:.1}", truth.touch)?;
    }
    let has = |effect: &&Effect| (effect.value)(&script).is_some();
    if !arguments.no_cost {
        // With the bare scene and the whole one.
        let seconds = (EFFECTS.iter().filter(has).count() + 2) as f64 * f64::from(ROUNDS) * LONGEST.as_secs_f64();
        note(format_args!("measuring what effects cost: about {seconds:.0} s"));
    }
    let mut costs = if arguments.no_cost { Vec::new() } else { costs(&script)? }.into_iter();
    let head = if arguments.no_cost { "" } else { "                                     ns per frame" };
    writeln!(out, "\nModeled:{head}")?;
    let total = |out: &mut Visible<_>, name: &str, cost: Option<Option<f64>>, what: &str| match cost.flatten() {
        Some(cost) => writeln!(out, "  {name:18} {:22} {cost:>10.0}  {what}", ""),
        None => Ok(()),
    };
    total(&mut out, "all below left out", costs.next(), "flashes of strain and a GREY camera without noise")?;
    for effect in EFFECTS.iter().filter(has) {
        let value = (effect.value)(&script).unwrap_or_default();
        match costs.next() {
            Some(Some(cost)) => writeln!(out, "  {:18} {value:22} {cost:>+10.0}  {}", effect.name, effect.what)?,
            Some(None) => writeln!(out, "  {:18} {value:22} {:>10}  {}", effect.name, "in noise", effect.what)?,
            None => writeln!(out, "  {:18} {value:22} {}", effect.name, effect.what)?,
        }
    }
    total(&mut out, "the whole", costs.next(), "less than the sum of the rest, because effects share work")?;
    writeln!(out, "\nNot in this scene, and without cost:")?;
    for effect in EFFECTS.iter().filter(|effect| !has(effect)) {
        writeln!(out, "  {:18} {}", effect.name, effect.what)?;
    }
    writeln!(out, "\nNever modeled:")?;
    NEVER.iter().try_for_each(|never| writeln!(out, "  {never}"))?;
    writeln!(
        out,
        "\nGuesses, because the publication does not give them: overlap, pitch, edge, flash and black\nlevel (wstac scene --help), and the spot of light of a base, a soft disc."
    )?;
    Ok(())
}

/// The number of repetitions. The shortest time counts, because noise of the machine only makes times longer.
const ROUNDS: u32 = 5;
/// The duration of a measurement.
const LONGEST: Duration = Duration::from_millis(100);

/// Returns costs in ns per frame: of the bare scene, of every effect of the scene, and of the whole. An effect has
/// `None` if its cost is within the noise of the measurement.
fn costs(script: &SceneConfig) -> Result<Vec<Option<f64>>, Error> {
    let mut scripts = vec![wstac_scene::effects::bare(script)];
    for effect in EFFECTS.iter().filter(|effect| (effect.value)(script).is_some()) {
        let mut without = script.clone();
        (effect.remove)(&mut without);
        scripts.push(without);
    }
    scripts.push(script.clone());
    // The two shortest times of each: their distance is the uncertainty.
    let mut least = vec![[f64::INFINITY; 2]; scripts.len()];
    // All are measured in turn, so that a slow moment of the machine does not fall on a single one.
    for _ in 0..ROUNDS {
        for (least, script) in least.iter_mut().zip(&scripts) {
            let ns = ns_a_frame(script)?;
            *least = if ns < least[0] { [ns, least[0]] } else { [least[0], least[1].min(ns)] };
        }
    }
    let (whole, last) = (least.last().copied().unwrap_or_default(), least.len().saturating_sub(1));
    let cost = |(index, [ns, next]): (usize, [f64; 2])| {
        if index == 0 || index == last {
            return Some(ns);
        }
        let (cost, doubt) = (whole[0] - ns, whole[1] - whole[0] + next - ns);
        // No effect makes a frame faster: a negative difference is noise, too.
        (cost > doubt).then_some(cost)
    };
    Ok(least.into_iter().enumerate().map(cost).collect())
}

/// Returns the mean over the frames from the first slide on, for at most 100 ms.
fn ns_a_frame(script: &SceneConfig) -> Result<f64, Error> {
    let mut scene = Scene::new(script)?;
    let first = scene.truth().first().map_or(0, Truth::start_frame);
    while scene.frame() < first && scene.next_shot().is_some() {}
    let (from, start) = (scene.frame(), Instant::now());
    while start.elapsed() < LONGEST && scene.next_shot().is_some() {}
    let frames = (scene.frame() - from).max(1);
    Ok(start.elapsed().as_secs_f64() * 1e9 / frames as f64)
}
