//! `wstac trade` shows what speed costs in accuracy.

mod choose;

use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::files::{Outputs, check_figure, ends};
use super::output::{Stop, note};
use super::units;
use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::plural::counted;
use wstac_host::text_file::{MOST_MAP_BYTES, file_text, file_text_of};
use wstac_tradeoff::budget::{Budget, By};
use wstac_tradeoff::candidate::Candidate;
use wstac_tradeoff::parameters::Setting;
use wstac_tradeoff::prices::{Core, Prices};
use wstac_tradeoff::row::{Row, rows};
use wstac_tradeoff::slides::{MOST_SLIDES, QUICK_SLIDES, SENSORS, SLIDES, slides};
use wstac_tradeoff::sweep::{self, Plan};
use wstac_tradeoff::{map, plot, table};

/// Show what speed costs in accuracy, and choose a configuration
///
/// Every camera format, pixel stride, logarithm, law and texture model is run on the same simulated slides, of sensors
/// that no model was trained on. The results are listed with their costs on boards, counted in an emulator. With
/// --budget nothing is run: the answer comes from the map that is built into wstac.
#[derive(Debug, clap::Args)]
#[command(after_long_help = HELP, arg_required_else_help = true)]
pub(super) struct Arguments {
    /// Write the results to this folder
    ///
    /// They are trade.csv, trade.md, trade.svg, map.csv and base.toml. With --budget it is the configuration. With
    /// --map the name can also be FILE.svg, for the figure alone.
    #[arg(short, value_name = "FOLDER")]
    output: Option<PathBuf>,

    /// Overwrite existing files
    #[arg(long, requires = "output")]
    force: bool,

    /// Number of slides of each sensor: 40 by default
    ///
    /// There are 20 sensors.
    #[arg(long, value_name = "1…110", value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST_SLIDES)))]
    slides: Option<u32>,

    /// Use a quarter of the slides
    #[arg(long, conflicts_with = "slides")]
    quick: bool,

    /// Use only this texture model, or these
    ///
    /// The option can be given several times. A model is a file, builtin or builtin:NAME. By default, all models that
    /// come with wstac are used.
    #[arg(long = "model", value_name = "FILE.wsm")]
    models: Vec<PathBuf>,

    /// Configuration of everything that the study does not vary
    ///
    /// It is a file as for wstac run.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,

    /// The core that tables and figures are for
    #[arg(long, value_enum, default_value = "M4F", conflicts_with = "verify")]
    core: Core,

    /// Run only the settings from number A on, below number B
    ///
    /// A setting is a format, stride, logarithm and law; the first has number 0. The results are map.csv and base.toml.
    /// Rows of all parts, in order, are those of the whole map.csv.
    #[arg(long, value_name = "A..B", value_parser = units::range, requires = "output",
        conflicts_with_all = ["map", "budget", "verify", "prices", "core"])]
    units: Option<Range<u32>>,

    /// Run nothing: read the map.csv of an earlier sweep
    ///
    /// "kept" is the map that comes with wstac.
    #[arg(long, value_name = "FILE")]
    map: Option<PathBuf>,

    /// Prices that ci/measure prices counted, instead of the built-in ones
    #[arg(long, value_name = "prices.json", conflicts_with = "verify")]
    prices: Option<PathBuf>,

    /// Print the most accurate configuration that fits these terms
    #[arg(long, value_name = "TERMS")]
    budget: Option<Budget>,

    /// Which accuracy decides
    #[arg(long, value_enum, default_value = "specimen", requires = "budget")]
    by: By,

    /// Run the configuration in this folder, and compare with its claim
    ///
    /// --budget -o wrote the folder.
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["output", "budget", "map", "slides", "quick", "config", "models"])]
    verify: Option<PathBuf>,
}

/// The name of the configuration file of a sweep, next to its map.
const BASE: &str = "base.toml";

const HELP: &str = "\
Terms of a budget, between commas:
  M0<150000        instructions per frame on M0 (M0+), M3, M4F or M7; k
                   and M are thousands and millions
  M4F.event<200k   instructions per event: speed, direction and texture
  flash<64K        bytes of the whole firmware with its model, on the
                   cores that other terms name, or else on --core; K is
                   1024 (64KB and 64KiB mean the same)
  ram<6K           bytes with the stack, but without the buffer for rows
                   (add 400 times 8 pixels)
  latency<0.6s     mean time from the first touch to the answer that --by
                   is about, at 30 frames per second; the same in frames is
                   frames<18. The wave answers at once, with models of 25
                   taxels, too; other laws and models of the path when 70
                   frames are there. A model over time that reads n frames
                   names textures after about n - 10.5, before the speed.
  format=GREY      the one that boards with a camera take; others are
                   RGB24, RGB565, BAYER8 (wstac run --format RGGB),
                   YUYV (exact or linear) and MJPEG; also stride=2,
                   ln=libm, law=edges, model=svm or model=none
  law=wave takes speed and direction from arrival times of 25 taxels,
  and alone reports slips; law=coherence and law=edges take them from
  those of ten sums, which hold for objects wider than the sensor.
  law=published takes them from durations.
  Models of the path are weighed with the first three, and models over
  time with the last.
  A core of 64 MHz with 30 frames per second, 10 % of its time and 1.75
  cycles per instruction has about 122k instructions per frame.
  MJPEG is judged by a quarter of the slides. A budget chooses it only if
  you ask for it or if nothing else fits.

Examples:
  wstac trade --budget 'M4F<60000,flash<64K,format=GREY'
  wstac trade --budget 'M0<180k,M0.event<400k,flash<64K' --by direction
  wstac trade --budget 'M4F<60k,M4F.event<500k' --by objects
  wstac trade --budget 'M4F<60000,flash<64K,format=GREY' -o small
  wstac trade --verify small
      run the choice again: the result must equal the claim, digit for
      digit; also print the result on other sensors
  wstac trade -o found
      run the whole sweep, which takes minutes
  wstac trade --units 0..168 -o 0
  wstac trade --units 168..336 -o 168
      run it in parts, on any number of machines; the rows of map.csv
      of all parts, in order, are the map (docs/MANY.md)
  wstac trade --quick --model my.wsm -o found
  wstac trade --budget 'frames<=40' --map found/map.csv -o early
  wstac trade --map kept -o map.svg
  Exit code: 0; 1 if nothing fits or a claim does not hold; 2 for a
  budget that cannot be read and for other wrong arguments.
";

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    refuse_sweep(arguments);
    if let Some(folder) = &arguments.verify {
        return choose::verify(folder);
    }
    let figure = figure(arguments)?;
    if let Some(budget) = &arguments.budget {
        return choose::choose(arguments, budget);
    }
    let config = arguments.config.as_deref().map_or_else(|| Ok(Config::default()), Config::read)?;
    if let Some(units) = &arguments.units {
        return part(arguments, units, &config);
    }
    match figure {
        Some(path) => outputs(arguments).check([path])?,
        None => check_new_all(arguments, &["trade.csv", "trade.md", "trade.svg", "map.csv", BASE])?,
    }
    let (prices, (_, base)) = (prices(arguments)?, base(arguments)?);
    let (rows, models) = if let Some(path) = &arguments.map {
        let rows = read(path)?;
        let models = of_rows(&rows)?;
        (rows, models)
    } else {
        let models = models(&arguments.models)?;
        (swept(arguments, &config, &models, &Setting::all())?, models)
    };
    let text = table::pareto(&rows, &prices, arguments.core);
    let draw = || plot::draw(&rows, &models, &prices, arguments.core);
    if let Some(path) = figure {
        outputs(arguments).write(path, draw())?;
    } else if let Some(folder) = &arguments.output {
        let outputs = write_map(arguments, folder, &rows, &base)?;
        outputs.write(&folder.join("trade.csv"), map::write_all(&rows, &models, &prices))?;
        outputs.write(&folder.join("trade.md"), &text)?;
        outputs.write(&folder.join("trade.svg"), draw())?;
    }
    print(&text)
}

/// Runs some of the settings, and writes their rows of the map.
fn part(arguments: &Arguments, units: &Range<u32>, config: &Config) -> Result<(), Stop> {
    check_new_all(arguments, &["map.csv", BASE])?;
    let (settings, models) = (Setting::all(), models(&arguments.models)?);
    let units = units::chosen(Some(units), settings.len(), "settings")?;
    let rows = swept(arguments, config, &models, &settings[units.start as usize..units.end as usize])?;
    // The option needs an output.
    let folder = arguments.output.as_deref().unwrap_or(Path::new("."));
    write_map(arguments, folder, &rows, &base(arguments)?.1)?;
    Ok(())
}

/// Writes a map and its configuration to a folder, and returns what else may be written there.
fn write_map(arguments: &Arguments, folder: &Path, rows: &[Row], base: &str) -> Result<Outputs, Error> {
    fs::create_dir_all(folder).map_err(|error| Error::io(folder.display(), error))?;
    let outputs = outputs(arguments);
    outputs.write(&folder.join("map.csv"), map::write(rows))?;
    outputs.write(&folder.join(BASE), base)?;
    Ok(outputs)
}

/// Ends the program if options of a sweep are given with options that run nothing.
fn refuse_sweep(arguments: &Arguments) {
    let of_sweep = [
        (!arguments.models.is_empty(), "--model"),
        (arguments.config.is_some(), "--config"),
        (arguments.slides.is_some(), "--slides"),
        (arguments.quick, "--quick"),
    ];
    let Some((_, option)) = of_sweep.into_iter().find(|(given, _)| *given) else { return };
    let (with, then) = match (&arguments.budget, &arguments.map) {
        (Some(_), _) => ("--budget", "--budget … --map FOLDER/map.csv"),
        (None, Some(_)) => ("--map", "--map FOLDER/map.csv"),
        (None, None) => return,
    };
    let message = format!(
        "{option} cannot be used with {with}, which runs nothing and reads a map: sweep first, \
         wstac trade {option} … -o FOLDER, then wstac trade {then}"
    );
    super::wrong_arguments(clap::error::ErrorKind::ArgumentConflict, message).exit();
}

/// Returns the file that the figure alone is written to, if the output is named like one.
fn figure(arguments: &Arguments) -> Result<Option<&Path>, Error> {
    let Some(path) = arguments.output.as_deref().filter(|path| !path.is_dir()) else { return Ok(None) };
    if !["svg", "png", "pdf"].iter().any(|ending| ends(path, ending)) {
        return Ok(None);
    }
    if arguments.map.is_none() || arguments.budget.is_some() {
        let expected =
            "only the figure of a map is a file (found a figure's name, expected a folder, or --map without --budget)";
        return Err(Error::new(ErrorKind::Usage, path.display(), expected));
    }
    check_figure(path)?;
    Ok(Some(path))
}

/// Refuses a path that is a file instead of a folder.
fn check_folder(folder: &Path) -> Result<(), Error> {
    if folder.exists() && !folder.is_dir() {
        let message = "is a file, expected a folder, or a name that does not exist";
        return Err(Error::new(ErrorKind::Io, folder.display(), message));
    }
    Ok(())
}

/// Refuses to overwrite these files of the folder without `force`.
fn check_new_all(arguments: &Arguments, names: &[&str]) -> Result<(), Error> {
    let Some(folder) = &arguments.output else { return Ok(()) };
    check_folder(folder)?;
    if !folder.exists() {
        return Outputs::check_room(&folder.join(BASE));
    }
    outputs(arguments).check(names.iter().map(|name| folder.join(name)))
}

/// Returns what the command may write: nothing that it reads.
fn outputs(arguments: &Arguments) -> Outputs {
    let base = arguments.map.as_ref().map(|map| map.with_file_name(BASE));
    let outputs = Outputs::new(arguments.force).reading(&arguments.models).reading(&arguments.config);
    outputs.reading(&arguments.map).reading(&base).reading(&arguments.prices)
}

/// Returns the name and the text of the configuration of a sweep: everything that the study does not vary.
fn base(arguments: &Arguments) -> Result<(String, String), Error> {
    let path = match (&arguments.config, &arguments.map) {
        (Some(path), _) => path.clone(),
        (None, Some(map)) if map != Path::new("kept") => map.with_file_name(BASE),
        _ => return Ok((BASE.to_owned(), String::new())),
    };
    let name = path.display().to_string();
    match file_text(&path) {
        Ok(text) => Ok((name, text)),
        Err(error) if let Some(map) = &arguments.map => {
            // Without a map its name is wrong.
            fs::metadata(map).map_err(|error| Error::io(map.display(), error))?;
            let message = format!("{}: expected the configuration of the sweep next to its map", error.message());
            Err(Error::new(error.kind(), name, message).caused_by(error))
        }
        Err(error) => Err(error),
    }
}

/// Returns the models of the rows of a map.
fn of_rows(rows: &[Row]) -> Result<Vec<Candidate>, Error> {
    let mut models: Vec<Candidate> = Vec::new();
    for name in rows.iter().filter_map(|row| row.model.as_ref()) {
        if models.iter().all(|model| model.name != *name) {
            models.push(Candidate::named(Path::new(name))?);
        }
    }
    Ok(models)
}

/// Runs these settings.
fn swept(
    arguments: &Arguments,
    config: &Config,
    models: &[Candidate],
    settings: &[Setting],
) -> Result<Vec<Row>, Error> {
    let of_each = if arguments.quick { QUICK_SLIDES } else { arguments.slides.unwrap_or(SLIDES) };
    let slides = slides(of_each);
    let (all, every, count) = (slides.len(), settings.len(), models.len());
    note(format_args!("{all} touches of {SENSORS} sensors, {every} settings, {}", counted(count, "model")));
    let plan = Plan { config, settings, models, slides: &slides };
    Ok(rows(&plan, &sweep::run(&plan)?))
}

/// Returns the map of an earlier sweep, or the one that comes with the program.
fn read(path: &Path) -> Result<Vec<Row>, Error> {
    if path == Path::new("kept") {
        return map::kept();
    }
    let text = file_text_of(path, MOST_MAP_BYTES)?;
    map::read(&path.display().to_string(), &text)
}

fn prices(arguments: &Arguments) -> Result<Prices, Error> {
    let Some(path) = &arguments.prices else { return Prices::kept() };
    let text = file_text(path)?;
    Prices::read(&path.display().to_string(), &text)
}

fn models(named: &[PathBuf]) -> Result<Vec<Candidate>, Error> {
    if named.is_empty() { Candidate::all_built_in() } else { named.iter().map(|name| Candidate::named(name)).collect() }
}

fn print(text: &str) -> Result<(), Stop> {
    Ok(std::io::Write::write_all(&mut super::output::stdout(), text.as_bytes())?)
}
