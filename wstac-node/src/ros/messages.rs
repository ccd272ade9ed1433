//! The messages of a sensor as ROS 2 has them. `wstac_msgs` has the definitions of those that no standard package has.

use std::time::{Duration, SystemTime};

use wstac_core::params::TAXELS;
use wstac_host::json::real;
use wstac_host::output::{Output, TactileEvent};
use wstac_host::texture::Texture;

use super::cdr::Cdr;
use super::names::Type;

#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct RosMessage {
    pub(crate) kind: Type,
    pub(crate) payload: Vec<u8>,
}

/// The time and the place that headers name.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Header<'a> {
    /// The time of the last frame that was taken.
    pub(crate) stamp: SystemTime,
    /// The coordinate frame of the sensor: x to the right along its rows, y up.
    pub(crate) frame_id: &'a str,
}

impl RosMessage {
    /// Returns the message of an output; `None` for those that ROS 2 is not told.
    pub(crate) fn of(output: &Output, header: Header<'_>) -> Option<Self> {
        let begun = Cdr::new();
        let (kind, cdr) = match output {
            Output::Features(features) => {
                let cdr = begun.header(header.stamp, header.frame_id).u64(features.frame);
                (Type::Features, features.features.iter().fold(cdr, |cdr, feature| cdr.f32(real(*feature) as f32)))
            }
            Output::Motion(motion) => {
                let (speed, angle) =
                    (f64::from(motion.velocity.mm_s) / 1000.0, f64::from(motion.velocity.degrees).to_radians());
                let twist = [speed * angle.cos(), speed * angle.sin(), 0.0, 0.0, 0.0, 0.0];
                let cdr = begun.header(header.stamp, header.frame_id);
                (Type::TwistStamped, twist.into_iter().fold(cdr, Cdr::f64))
            }
            Output::Event(event) => (Type::Event, of_event(event, header)),
            Output::ContactEnd(end) => {
                let cdr = begun.header(header.stamp, header.frame_id);
                (Type::ContactEnd, cdr.u64(end.frame).u64(end.event_frame))
            }
            Output::Slip(slip) => {
                let cdr = begun.header(header.stamp, header.frame_id).u64(slip.frame).u64(slip.onset_frame);
                (Type::Slip, cdr.u64(slip.held_since_frame).f64(slip.strength.into()))
            }
            _ => return None,
        };
        Some(Self { kind, payload: cdr.finish() })
    }

    pub(crate) fn of_taxels(frame: u64, sums: &[u32; TAXELS], header: Header<'_>) -> Self {
        let cdr = Cdr::new().header(header.stamp, header.frame_id).u64(frame);
        Self { kind: Type::Taxels, payload: sums.iter().fold(cdr, |cdr, sum| cdr.u32(*sum)).finish() }
    }
}

fn of_event(event: &TactileEvent, header: Header<'_>) -> Cdr {
    // Without a time of its own, it is that of the answer's last frame, and the touch was before it.
    let since = event.completed_ns.zip(event.time_ns).map(|(completed, touch)| completed.saturating_sub(touch));
    let since = Duration::from_nanos(since.filter(|_| event.stamp.is_none()).unwrap_or_default());
    let stamp = header.stamp.checked_sub(since).unwrap_or(header.stamp);
    let number = |number: Option<f32>| number.map_or(f64::NAN, f64::from);
    let speed = event.speed.ok();
    let texture = event.texture.as_ref().ok();
    let extent = event.extent;
    let lengths = [extent.and_then(|extent| extent.place_mm), extent.and_then(|extent| extent.width_mm)];
    let cdr = Cdr::new()
        .header(stamp, header.frame_id)
        .u64(event.frame)
        .text(event.contact.map_or("", |contact| contact.as_str()))
        .f64(number(speed.map(|speed| speed.mm_s)) / 1000.0)
        .f64(number(speed.and_then(|speed| speed.sd)) / 1000.0)
        .f64(number(event.direction.degrees.ok()).to_radians())
        .f64(number(event.direction.sd).to_radians())
        .text(&texture.map_or(String::new(), name_of))
        .f64(texture.and_then(|texture| texture.confidence).unwrap_or(f64::NAN))
        .bool(texture.is_some_and(|texture| texture.known == Some(true)))
        .bool(event.reliable)
        .u8(event.frames_filled)
        .text(event.basis.map_or("", |basis| basis.as_str()))
        .u8(extent.map_or(0, |extent| extent.contacts));
    let measured = lengths.into_iter().chain([event.acceleration, event.period_mm]).flat_map(|found| {
        [found.map(|found| found.value), found.map(|found| found.sd)].map(|found| number(found) / 1000.0)
    });
    measured.fold(cdr, Cdr::f64).text(event.doubt.map_or("", |doubt| doubt.as_str()))
}

/// Returns the specimen, or else what is known of it.
fn name_of(texture: &Texture) -> String {
    let depth = texture.depth_mm.map(|depth| depth.to_string());
    let parts = [texture.pattern.clone(), depth].into_iter().flatten().collect::<Vec<_>>().join(" ");
    texture.specimen.clone().or_else(|| texture.class.clone()).unwrap_or(parts)
}
