//! `wstac trade --fade` shows how answers degrade as light fades.

use std::path::PathBuf;

use super::{Arguments, check_new_all, models, outputs, print, write};
use crate::commands::output::{Stop, note};
use wstac_host::config::Config;
use wstac_host::error::Error;
use wstac_tradeoff::fade::{self, LEVELS, peak};
use wstac_tradeoff::slides::{QUICK_SLIDES, slides};

/// The models that come with the program, that of the default setting first.
const MODELS: [&str; 3] = ["builtin:svm", "builtin:forest", "builtin:boosted"];

pub(super) fn fade(arguments: &Arguments, config: &Config) -> Result<(), Stop> {
    check_new_all(arguments, &["fade.csv", "fade.md"])?;
    let named = if arguments.models.is_empty() { &MODELS.map(PathBuf::from)[..] } else { &arguments.models };
    let models = models(named)?;
    let slides = slides(arguments.slides.unwrap_or(QUICK_SLIDES));
    let levels = if arguments.light.is_empty() { &LEVELS[..] } else { &arguments.light };
    note(format_args!(
        "{} slides; the unchanged reference slide has a peak of {:.1} gray levels",
        slides.len(),
        peak()?
    ));
    let mut all = Vec::with_capacity(levels.len());
    for level in levels {
        note(format_args!("peak light of {level} gray levels"));
        all.push(fade::fade(*level, config, &models, &slides)?);
    }
    let text = fade::tables(&all);
    if let Some(folder) = &arguments.output {
        std::fs::create_dir_all(folder).map_err(|error| Error::io(folder.display(), error))?;
        let outputs = outputs(arguments);
        write(&outputs, folder, "fade.csv", &fade::csv(&all))?;
        write(&outputs, folder, "fade.md", &text)?;
    }
    print(&text)
}
