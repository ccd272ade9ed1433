//! `wstac scene render`: a scene's frames in a file.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use super::super::output::{Stop, note};
use super::named;
use crate::error::Error;
use crate::source::open::{OpenOptions, script};
use crate::source::scene::SceneSource;
use crate::source::y4m::header_of;
use crate::source::{Item, Source};

/// Write a scene's frames to a new file
///
/// Only pixels under whiskers are computed; all others stay dark.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Saw3@150[,90deg][,seed=N], or FILE.toml
    scene: String,

    /// FILE.y4m (formats GREY, Y10, Y12, Y16, YU12 and 422P), FILE.raw (frames of any format back to back), or - for Y4M
    /// on standard output
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,

    /// Write over a file that is there already
    #[arg(long)]
    force: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Stop> {
    let mut source = SceneSource::new(&script(named(&arguments.scene), &OpenOptions::default())?)?;
    let path = arguments.output.as_path();
    let info = source.info().clone();
    if info.taxels_only {
        return Err(Error::new(&info.about, "has no frames, expected fidelity = \"rendered\"").into());
    }
    let raw = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("raw"));
    let y4m = path == Path::new("-") || path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("y4m"));
    if !raw && !y4m {
        return Err(Error::new(path.display(), "expected a name that ends in .y4m or .raw, or -").into());
    }
    let header =
        if raw { None } else { Some(header_of(&info).map_err(|message| Error::new(path.display(), message))?) };
    note(&info.about);
    let mut out = Output::create(path, arguments.force)?;
    if let Some(header) = &header {
        out.write(header.as_bytes())?;
    }
    let mut lost = 0;
    loop {
        match source.next()? {
            Item::Frame { bytes, .. } => {
                if header.is_some() {
                    out.write(b"FRAME\n")?;
                }
                out.write(bytes)?;
            }
            Item::Lost { frames, .. } => lost += frames,
            Item::Taxels(_) | Item::Waiting => {}
            Item::End => break,
        }
    }
    out.finish()?;
    if lost > 0 {
        note(format_args!("{lost} lost frame(s) left no bytes"));
    }
    Ok(())
}

/// A file that gets its name when it is whole, or standard output.
enum Output {
    Standard(BufWriter<std::io::Stdout>),
    File { file: BufWriter<File>, path: PathBuf, part: PathBuf },
}

impl Output {
    fn create(path: &Path, force: bool) -> Result<Self, Error> {
        if path == Path::new("-") {
            return Ok(Self::Standard(BufWriter::new(std::io::stdout())));
        }
        if path.exists() && !force {
            return Err(Error::new(path.display(), "exists already, expected a new file or --force"));
        }
        let mut part = path.as_os_str().to_owned();
        part.push(".part");
        let part = PathBuf::from(part);
        let file = File::create(&part).map_err(|error| Error::new(part.display(), error))?;
        Ok(Self::File { file: BufWriter::new(file), path: path.to_owned(), part })
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), Stop> {
        match self {
            Self::Standard(out) => Ok(out.write_all(bytes)?),
            Self::File { file, part, .. } => {
                file.write_all(bytes).map_err(|error| Error::new(part.display(), error).into())
            }
        }
    }

    fn finish(self) -> Result<(), Stop> {
        match self {
            Self::Standard(mut out) => Ok(out.flush()?),
            Self::File { mut file, path, part } => {
                file.flush().map_err(|error| Error::new(part.display(), error))?;
                fs::rename(&part, &path).map_err(|error| Error::new(path.display(), error).into())
            }
        }
    }
}
