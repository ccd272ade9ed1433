//! The orders that requests to services contain. Files are read here: reading one may take longer than a frame.

use std::path::{Path, PathBuf};

use wstac_host::config::Config;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::model_file::{BEST, BUILT_IN, ModelFile};
use wstac_host::record::labels::{by_name, parse};
use wstac_host::source::Labels;
use wstac_host::texture::Textures;
use wstac_host::visible;

use super::cdr::CdrReader;
use super::services::Service;
use crate::orders::{Action, path_in};

/// Returns what a request asks of a sensor; `None` if it is no message of the service, or if the service is none of a
/// sensor. `folder` is that of the files.
pub(super) fn action(service: Service, folder: Option<&Path>, payload: &[u8]) -> Option<Result<Action, Error>> {
    let mut reader = CdrReader::new(payload)?;
    Some(match service {
        // An empty message, of which rosidl makes one byte.
        Service::RestartBaseline | Service::StopRecording if reader.left() > 1 => return None,
        Service::RestartBaseline => Ok(Action::RestartBaseline),
        Service::StopRecording => Ok(Action::StopRecording),
        Service::StartRecording => {
            let (file, features_only) = (reader.text()?, reader.bool()?);
            let labels = reader.list(CdrReader::text)?;
            start_recording(folder, file, features_only, &labels)
        }
        Service::LoadConfig => use_config(folder, reader.text()?),
        Service::LoadModel => use_model(folder, reader.text()?),
        _ => return None,
    })
}

fn start_recording(folder: Option<&Path>, file: &str, features_only: bool, labels: &[&str]) -> Result<Action, Error> {
    // Without a name the sensor finds one.
    let path = path_in(folder, if file.is_empty() { "recording" } else { file })?;
    // Other programs find recordings in a folder by their ending.
    if !file.is_empty() && path.extension().is_none_or(|ending| ending != "mcap") {
        let message = "expected the ending .mcap, as of slide.mcap";
        return Err(Error::new(ErrorKind::Usage, format_args!("file is \"{file}\""), message));
    }
    let folder = path.parent().map(Path::to_owned).unwrap_or_default();
    let labels = labels_of(labels).map_err(|message| Error::new(ErrorKind::Usage, "labels", message))?;
    Ok(Action::StartRecording { folder, file: file.to_owned(), features_only, labels })
}

/// Returns labels that are written as NAME=VALUE.
fn labels_of(given: &[&str]) -> Result<Labels, String> {
    if let Some(wrong) = given.iter().find(|text| visible::line(text) != **text) {
        return Err(format!("\"{}\" has control characters; leave them out", visible::line(wrong)));
    }
    by_name(given.iter().map(|text| parse(text)).collect::<Result<Vec<_>, _>>()?)
}

fn use_config(folder: Option<&Path>, file: &str) -> Result<Action, Error> {
    let file = path_in(folder, file)?;
    Ok(Action::UseConfig { config: Config::read_stored(&file)?.into(), file })
}

fn use_model(folder: Option<&Path>, file: &str) -> Result<Action, Error> {
    // Models that come with the program are in no folder.
    let (file, model) = if file == BEST || file.starts_with(BUILT_IN) {
        (PathBuf::from(file), ModelFile::open(Path::new(file))?)
    } else {
        let file = path_in(folder, file)?;
        let model = ModelFile::open_stored(&file)?;
        (file, model)
    };
    Ok(Action::UseModel { textures: Textures::new(&[model])?, file })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros::cdr::Cdr;

    fn asked(service: Service, payload: &[u8]) -> Option<Result<Action, String>> {
        action(service, Some(Path::new("files")), payload).map(|result| result.map_err(|error| error.to_string()))
    }

    #[test]
    fn a_request_without_fields_has_one_byte_at_most() {
        for service in [Service::RestartBaseline, Service::StopRecording] {
            for payload in [&[0, 1, 0, 0][..], &[0, 1, 0, 0, 0]] {
                assert!(matches!(asked(service, payload), Some(Ok(_))), "{payload:?}");
            }
            for payload in [&[][..], &[0, 1, 0], &[0, 0, 0, 0, 0], &[0, 1, 0, 0, 0, 0]] {
                assert!(asked(service, payload).is_none(), "{payload:?}");
            }
        }
        assert!(asked(Service::GetParameters, &[0, 1, 0, 0, 0]).is_none(), "a service of the node");
    }

    #[test]
    fn a_model_of_the_program_needs_no_folder() {
        let request = |name: &str| action(Service::LoadModel, None, &Cdr::new().text(name).finish()).unwrap();
        for name in ["builtin", "builtin:svm"] {
            assert!(matches!(request(name), Ok(Action::UseModel { file, .. }) if file == Path::new(name)));
        }
        assert!(request("builtin:none").unwrap_err().to_string().contains("builtin:none"));
        assert!(request("svm.wsm").is_err());
    }

    #[test]
    fn a_recording_has_labels() {
        let request = |labels: &[&str]| {
            let cdr = Cdr::new().text("a.mcap").bool(true).u32(labels.len() as u32);
            labels.iter().fold(cdr, |cdr, label| cdr.text(label)).finish()
        };
        let found = asked(Service::StartRecording, &request(&["specimen=Saw3", "speed=150"])).unwrap().unwrap();
        let Action::StartRecording { folder, file, features_only: true, labels } = found else { panic!("{found:?}") };
        assert_eq!((&*folder, &*file), (Path::new("files"), "a.mcap"));
        assert_eq!(labels.into_iter().map(|label| label.1).collect::<Vec<_>>(), ["Saw3", "150"]);
        for (labels, part) in [
            (&["Saw3"][..], "labels: \"Saw3\" is no label, expected NAME=VALUE"),
            (&["speed=fast"], "labels: label speed is \"fast\", expected mm/s"),
            (&["speed=1", "speed=2"], "expected one value"),
            (&["note=a\u{202e}b"], "labels: \"note=a\\u202eb\" has control characters"),
        ] {
            let error = asked(Service::StartRecording, &request(labels)).unwrap().unwrap_err();
            assert!(error.contains(part), "{error}");
        }
        // The message of an older definition ends before the labels.
        assert!(asked(Service::StartRecording, &Cdr::new().text("a.mcap").bool(true).finish()).is_none());
    }
}
