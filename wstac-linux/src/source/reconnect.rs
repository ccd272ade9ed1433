//! Reconnects from a stream that broke off to the same camera's next frame.

use std::thread;
use std::time::Duration;

use super::{CameraSource, stream};
use crate::choose::same;
use crate::{Camera, Negotiated};
use wstac_host::camera::LockedControl;
use wstac_host::error::{Error, ErrorKind};
use wstac_host::plural::counted;
use wstac_host::source::{Fault, FaultKind, LossReason, Remedy, SourceEvent, StreamInfo};

/// The pause from one try to the next.
const PAUSE: Duration = Duration::from_millis(500);

/// A break of the stream, from its last buffer to the next one.
#[derive(Debug, Default)]
pub(super) struct Away {
    /// Whether the input has no signal. That was reported, and its end will be.
    no_signal: bool,
    /// Whether a start was tried.
    tried: bool,
    /// The reports about tries that failed, each once.
    said: Vec<String>,
}

impl Away {
    pub(super) fn without_signal() -> Self {
        Self { no_signal: true, ..Self::default() }
    }

    /// Returns why frames were lost meanwhile.
    pub(super) fn reason(&self) -> LossReason {
        if self.no_signal { LossReason::NoSignal } else { LossReason::Disconnected }
    }

    /// Returns a fault that reports the break's end; `None` if the signal's return reports it.
    pub(super) fn back(&self, info: &StreamInfo, lost: u64) -> Option<Fault> {
        if self.no_signal {
            return None;
        }
        let state = info.camera.as_deref();
        let name = state.map(|state| format!("{}: {}", state.path.display(), state.card)).unwrap_or_default();
        Some(Fault::new(FaultKind::Reconnected, format!("{name} is back; {} lost meanwhile", counted(lost, "frame"))))
    }

    /// Returns whether this is reported for the first time, and notes it.
    fn is_new(&mut self, message: &str) -> bool {
        let new = !self.said.iter().any(|said| said == message);
        if new {
            self.said.push(message.to_owned());
        }
        new
    }
}

impl CameraSource {
    /// Closes the camera after the stream broke off. It is looked for from now on.
    pub(super) fn part(&mut self, why: &str) {
        (self.lent, self.next, self.trouble) = (None, None, None);
        self.ready.clear();
        self.camera = None;
        self.known.look_around();
        let away = self.away.get_or_insert_default();
        away.no_signal = false;
        if away.is_new(why) {
            let remedy = Some(Remedy::AwaitCamera);
            self.told.push_back(SourceEvent::Fault(Fault { remedy, ..Fault::new(FaultKind::Disconnected, why) }));
        }
    }

    /// Looks for the camera and starts it.
    ///
    /// If it is not there yet, or refuses, nothing happens: the next call tries again.
    pub(super) fn try_reconnect(&mut self) -> Result<(), Error> {
        let away = self.away.get_or_insert_default();
        // The first try comes at once, because most faults are over then.
        if std::mem::replace(&mut away.tried, true) {
            thread::sleep(PAUSE);
        }
        let Some(path) = self.known.find() else { return Ok(()) };
        self.path = path;
        match Camera::open(&self.path, &self.options) {
            Ok(camera) => self.resume(camera),
            Err(error) => {
                let why = error.to_string();
                if away.is_new(&why) {
                    let remedy = Some(Remedy::Retry);
                    self.told.push_back(SourceEvent::Fault(Fault { remedy, ..Fault::new(FaultKind::Refused, why) }));
                }
                Ok(())
            }
        }
    }

    /// Resumes a stream that was started again, if its format is the same as before.
    fn resume(&mut self, camera: Camera) -> Result<(), Error> {
        if let Some(difference) = difference(&self.negotiated, &camera.negotiated) {
            return Err(Error::new(ErrorKind::Device, self.path.display(), difference));
        }
        let state = Some(Box::new(camera.state.clone()));
        let before = std::mem::replace(&mut self.info.camera, state).map(|state| state.controls).unwrap_or_default();
        if let Some(changed) = changed(&before, &camera.state.controls) {
            let message = format!("{}: {changed}: gray levels may have changed", self.path.display());
            self.told.push_back(SourceEvent::Fault(Fault::new(FaultKind::Controls, message)));
        }
        (self.waits, self.errors) = (0, 0);
        self.camera = Some(camera);
        Ok(())
    }
}

/// Returns how the format differs from the one that was agreed on; `None` if it is the same.
fn difference(before: &Negotiated, now: &Negotiated) -> Option<String> {
    let is_same = before.fourcc == now.fourcc
        && before.size == now.size
        && before.color == now.color
        && before.bytes_per_row == now.bytes_per_row
        && before.frame_bytes == now.frame_bytes
        && same(before.rate, now.rate);
    let words = |negotiated: &Negotiated| {
        let color = negotiated.color;
        format!("{} ({} bytes per row, {:?})", stream(negotiated), negotiated.bytes_per_row, color)
    };
    (!is_same).then(|| format!("the camera came back with {}, expected {} as before", words(now), words(before)))
}

/// Returns the controls that have another value than before.
fn changed(before: &[LockedControl], now: &[LockedControl]) -> Option<String> {
    let changes = now.iter().filter_map(|control| {
        let was = before.iter().find(|was| was.id == control.id && was.value != control.value)?;
        Some(format!("{} was {}, is {}", control.name, was.value, control.value))
    });
    let changes: Vec<_> = changes.collect();
    (!changes.is_empty()).then(|| changes.join(", "))
}

#[cfg(test)]
mod tests {
    use wstac_core::green::any::PixelFormat;
    use wstac_core::green::ycbcr::YcbcrEncoding;
    use wstac_core::layout::FrameSize;
    use wstac_core::rate::FrameRate;

    use super::*;
    use wstac_host::camera::formats::Coding;

    fn negotiated() -> Negotiated {
        Negotiated {
            fourcc: *b"GREY",
            coding: Coding::Raw(PixelFormat::Gray),
            size: FrameSize::new(640, 360).unwrap(),
            color: YcbcrEncoding::default(),
            bytes_per_row: 640,
            frame_bytes: 640 * 360,
            rate: FrameRate::NOMINAL,
            notes: Vec::new(),
        }
    }

    #[test]
    fn a_stream_that_comes_back_is_what_it_was() {
        let before = Negotiated { notes: vec!["said once".into()], ..negotiated() };
        assert_eq!(difference(&before, &negotiated()), None);
        // This is the same rate in other numbers.
        let rate = FrameRate::new(30_000, 1001).unwrap();
        assert_eq!(difference(&before, &Negotiated { rate, ..negotiated() }), None);
        let rate = FrameRate::new(15, 1).unwrap();
        let said = difference(&before, &Negotiated { rate, ..negotiated() }).unwrap();
        assert!(said.contains("came back with GREY 640x360, 15 fps"), "{said}");
        assert!(said.contains("expected GREY 640x360, 30 fps"), "{said}");
        assert!(difference(&before, &Negotiated { bytes_per_row: 704, ..negotiated() }).is_some());
    }

    #[test]
    fn controls_that_changed_are_named() {
        let control =
            |id, value| LockedControl { id, value, name: format!("Control {id}"), ..LockedControl::default() };
        let before = [control(1, 5), control(2, 6)];
        assert_eq!(changed(&before, &before), None);
        assert_eq!(changed(&before, &[control(2, 7), control(3, 1)]).unwrap(), "Control 2 was 6, is 7");
    }

    #[test]
    fn a_refusal_is_said_once() {
        let mut away = Away::default();
        assert!(away.is_new("busy"));
        assert!(away.is_new("no memory"));
        assert!(!away.is_new("busy"));
    }
}
