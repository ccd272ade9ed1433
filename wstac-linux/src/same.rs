//! Finds the camera that was lost when cameras come back.
//!
//! The numbers of nodes say nothing. A camera that is plugged in again may get another number, and another camera the
//! old one. These facts identify a camera, the best first:
//!
//! 1. the link by serial number (`/dev/v4l/by-id`);
//! 2. the link by place (`/dev/v4l/by-path`);
//! 3. the driver's answer: the card's name and the bus.
//!
//! Cameras of one kind often share a serial number. So a camera at another place is the same only under one condition:
//! no camera was at that place while ours was at its own.

use std::path::{Path, PathBuf};

use super::device::{Device, Identity};
use super::{CameraState, devices, unusable};

const BY_ID: &str = "/dev/v4l/by-id";

/// The facts that identify a camera.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct KnownCamera {
    /// The path that the user knows it by.
    path: PathBuf,
    /// Links that stay the same: those by serial number if there are any, otherwise those by place.
    links: Vec<PathBuf>,
    card: String,
    bus: String,
    /// The places of other cameras while this one was there.
    taken: Vec<String>,
}

impl KnownCamera {
    /// Takes the facts of a camera that is there.
    pub(crate) fn new(state: &CameraState) -> Self {
        let (card, bus) = (state.card.clone(), state.bus.clone());
        let mut known = Self { path: state.path.clone(), links: lasting(&state.links), card, bus, taken: Vec::new() };
        known.look_around();
        known
    }

    /// Notes the places of other cameras. Only a link by serial number can lead to another place.
    pub(crate) fn look_around(&mut self) {
        if !self.by_id() {
            return;
        }
        for path in devices::nodes() {
            let Some(identity) = identity(&path) else { continue };
            if identity.bus != self.bus && !self.taken.contains(&identity.bus) {
                self.taken.push(identity.bus);
            }
        }
    }

    /// Returns the node that this camera has now; `None` if it is not there.
    pub(crate) fn find(&self) -> Option<PathBuf> {
        let nodes = if self.links.is_empty() { devices::nodes() } else { self.targets() };
        // The old path comes first: cameras with several nodes and no links differ in nothing else.
        let old = self.path.canonicalize().ok();
        let old = old.filter(|path| nodes.contains(path));
        let node = old.iter().chain(&nodes).find(|node| identity(node).is_some_and(|found| self.is(&found)))?;
        // The name that the user gave is kept as long as it leads there.
        let same = self.path.canonicalize().is_ok_and(|target| target == *node);
        Some(if same { self.path.clone() } else { node.clone() })
    }

    /// Returns the nodes that the links lead to, each once.
    fn targets(&self) -> Vec<PathBuf> {
        let mut nodes: Vec<PathBuf> = self.links.iter().filter_map(|link| link.canonicalize().ok()).collect();
        nodes.dedup();
        nodes
    }

    /// Returns whether a node that was found is this camera.
    ///
    /// A link leads to the node; if there are no links, it may be any node.
    fn is(&self, found: &Identity) -> bool {
        let place = found.bus == self.bus || (self.by_id() && !self.taken.contains(&found.bus));
        place && found.card == self.card
    }

    fn by_id(&self) -> bool {
        self.links.iter().any(|link| link.starts_with(BY_ID))
    }
}

/// Returns the links by serial number if there are any, otherwise those by place.
fn lasting(links: &[PathBuf]) -> Vec<PathBuf> {
    let by_id: Vec<PathBuf> = links.iter().filter(|link| link.starts_with(BY_ID)).cloned().collect();
    if by_id.is_empty() { links.to_vec() } else { by_id }
}

/// Returns the identity of a node; `None` if it does not capture video.
fn identity(path: &Path) -> Option<Identity> {
    let identity = Device::open(path).ok()?.identity().ok()?;
    unusable(identity.capabilities).is_none().then_some(identity)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known(links: &[&str], taken: &[&str]) -> KnownCamera {
        let links: Vec<PathBuf> = links.iter().map(PathBuf::from).collect();
        KnownCamera {
            path: "/dev/video0".into(),
            links: lasting(&links),
            card: "Camera".into(),
            bus: "usb-1".into(),
            taken: taken.iter().map(|bus| (*bus).to_owned()).collect(),
        }
    }

    fn found(card: &str, bus: &str) -> Identity {
        Identity { card: card.into(), driver: "uvcvideo".into(), bus: bus.into(), capabilities: 0 }
    }

    const SERIAL: &str = "/dev/v4l/by-id/usb-Camera_123-video-index0";
    const PLACE: &str = "/dev/v4l/by-path/pci-0000:00:14.0-usb-0:1:1.0-video-index0";

    #[test]
    fn a_serial_number_counts_more_than_a_place() {
        assert_eq!(known(&[SERIAL, PLACE], &[]).links, [PathBuf::from(SERIAL)]);
        assert_eq!(known(&[PLACE], &[]).links, [PathBuf::from(PLACE)]);
    }

    #[test]
    fn a_serial_number_is_found_at_another_place() {
        assert!(known(&[SERIAL, PLACE], &[]).is(&found("Camera", "usb-2")));
        assert!(!known(&[SERIAL, PLACE], &[]).is(&found("Other", "usb-2")), "another kind of camera");
    }

    #[test]
    fn a_twin_with_the_same_serial_number_is_another_camera() {
        let known = known(&[SERIAL, PLACE], &["usb-2"]);
        assert!(!known.is(&found("Camera", "usb-2")));
        assert!(known.is(&found("Camera", "usb-1")) && known.is(&found("Camera", "usb-3")));
    }

    #[test]
    fn without_a_serial_number_the_place_decides() {
        for links in [&[PLACE][..], &[]] {
            let known = known(links, &[]);
            assert!(known.is(&found("Camera", "usb-1")));
            assert!(!known.is(&found("Camera", "usb-2")));
            assert!(!known.is(&found("Other", "usb-1")));
        }
    }

    #[test]
    fn what_is_no_camera_is_not_found() {
        // Neither link leads anywhere on any machine.
        assert_eq!(known(&["/dev/v4l/by-id/no-such-camera"], &[]).find(), None);
        assert_eq!(identity(Path::new("/dev/null")), None);
        assert_eq!(identity(Path::new("/dev/no-such-video")), None);
    }
}
