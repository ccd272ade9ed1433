//! Camera bytes → features at about 30 frames per second: sums, frames added up, logarithms (SPEC §1, §2).

use crate::error::{ConfigError, FrameError};
use crate::features::{FeatureScale, Features, Floor, line_sums};
use crate::green::GreenChannel;
use crate::ln::Ln;
use crate::params::{FEATURES, TAXELS};
use crate::taxels::{FrameGeometry, TaxelSums};
use crate::touch::taxel_ring::{NoTaxels, TaxelStore};

/// The features of one feature frame, which is one camera frame, or several above 45 frames per second.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct FeatureFrame {
    /// The ten features, five rows, then five columns, in units of 2^-11.
    pub features: Features,
    /// Whether some, but not all, of its camera frames were lost. The others stand for them.
    pub has_missing_frames: bool,
}

impl FeatureFrame {
    /// Creates a feature frame; `has_missing_frames` says whether some of its camera frames were lost.
    pub const fn new(features: Features, has_missing_frames: bool) -> Self {
        Self { features, has_missing_frames }
    }
}

/// Holds whatever lost camera frames brought about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Loss {
    /// The feature frame that was under way, if they complete it.
    pub has_missing_frames: Option<FeatureFrame>,
    /// Feature frames that are lost entirely after that one.
    pub frames: u64,
}

/// Turns camera bytes into features.
#[derive(Clone, Debug)]
pub struct FeatureStream<G: GreenChannel, L> {
    accumulators: TaxelSums<G>,
    scale: FeatureScale<L>,
    /// Line sums of the camera frames that have arrived for the present feature frame.
    lines: [u32; FEATURES],
    present: u32,
    lost: u32,
    started: bool,
}

impl<G: GreenChannel, L: Ln> FeatureStream<G, L> {
    /// Creates a stream from this camera with a floor of `floor_levels` gray levels of a taxel.
    ///
    /// # Errors
    /// Returns [`ConfigError::FloorLevels`] if the floor is not 0 to the green full scale.
    pub fn new(camera: FrameGeometry<G>, floor_levels: f64) -> Result<Self, ConfigError> {
        Self::with_floor(camera, Floor::new(floor_levels, camera.full_scale())?)
    }

    /// Creates a stream with a computed floor.
    ///
    /// # Errors
    /// Returns [`ConfigError::FloorFullScale`] if the floor is for pixels of another full scale.
    pub fn with_floor(camera: FrameGeometry<G>, floor: Floor) -> Result<Self, ConfigError> {
        Self::with_ln(camera, floor, L::default())
    }

    /// Creates a stream with a computed floor and a log kernel that was chosen at run time.
    ///
    /// # Errors
    /// Returns [`ConfigError::FloorFullScale`] if the floor is for pixels of another full scale.
    pub fn with_ln(camera: FrameGeometry<G>, floor: Floor, ln: L) -> Result<Self, ConfigError> {
        let frames = camera.rate().frames_added();
        Ok(Self {
            scale: FeatureScale::with_ln(camera.pixels(), camera.full_scale(), frames, floor, ln)?,
            accumulators: TaxelSums::new(camera),
            lines: [0; FEATURES],
            present: 0,
            lost: 0,
            started: false,
        })
    }

    /// Returns the geometry of the camera's frames.
    pub fn camera(&self) -> &FrameGeometry<G> {
        self.accumulators.camera()
    }

    /// Takes a whole frame. Returns features if it completes a feature frame.
    ///
    /// # Errors
    /// Returns the errors of [`TaxelSums::push_frame`]; then nothing has changed.
    pub fn push_frame(&mut self, bytes: &[u8]) -> Result<Option<FeatureFrame>, FrameError> {
        self.push_frame_to(bytes, &mut NoTaxels)
    }

    /// Takes a whole frame, and hands its taxels to `store`.
    pub(crate) fn push_frame_to(
        &mut self,
        bytes: &[u8],
        store: &mut impl TaxelStore,
    ) -> Result<Option<FeatureFrame>, FrameError> {
        let taxels = self.accumulators.push_frame(bytes)?;
        Ok(self.add(&taxels, store))
    }

    /// Takes the next rows of a frame. Returns features if they complete a feature frame.
    ///
    /// # Errors
    /// Returns the errors of [`TaxelSums::push_stripe`]; then nothing has changed.
    pub fn push_stripe(&mut self, bytes: &[u8]) -> Result<Option<FeatureFrame>, FrameError> {
        self.push_stripe_to(bytes, &mut NoTaxels)
    }

    /// Takes the next rows of a frame, and hands its taxels to `store`.
    pub(crate) fn push_stripe_to(
        &mut self,
        bytes: &[u8],
        store: &mut impl TaxelStore,
    ) -> Result<Option<FeatureFrame>, FrameError> {
        match &self.accumulators.push_stripe(bytes) {
            Ok(Some(taxels)) => Ok(self.add(taxels, store)),
            Ok(None) => Ok(None),
            Err(error) => Err(*error),
        }
    }

    /// Takes the 25 taxel sums of a frame that was summed elsewhere. Each is at most G · A; larger ones saturate.
    pub fn push_taxels(&mut self, taxels: &[u32; TAXELS]) -> Option<FeatureFrame> {
        self.push_taxels_to(taxels, &mut NoTaxels)
    }

    /// Takes the 25 taxel sums of a frame, and hands them to `store`.
    pub(crate) fn push_taxels_to(
        &mut self,
        taxels: &[u32; TAXELS],
        store: &mut impl TaxelStore,
    ) -> Option<FeatureFrame> {
        self.accumulators.forget_taxels();
        self.add(taxels, store)
    }

    /// Returns the taxel sums of the last camera frame that was pushed as bytes, until the next frame begins or is
    /// lost.
    pub fn taxels(&self) -> Option<[u32; TAXELS]> {
        self.accumulators.taxels()
    }

    /// Returns the sums of the frame under way.
    pub(crate) fn sums(&mut self) -> &mut TaxelSums<G> {
        &mut self.accumulators
    }

    /// Starts again: the next camera frame is the stream's first. Rows and camera frames of an incomplete feature frame
    /// are forgotten.
    pub fn restart(&mut self) {
        self.accumulators.abandon_rows();
        self.lines = [0; FEATURES];
        (self.present, self.lost, self.started) = (0, 0, false);
    }

    /// Replaces the darkness floor.
    ///
    /// # Errors
    /// Returns [`ConfigError::FloorFullScale`] if the floor is for pixels of another full scale; then nothing has
    /// changed.
    pub fn set_floor(&mut self, floor: Floor) -> Result<(), ConfigError> {
        self.scale.set_floor(floor, self.accumulators.camera().full_scale())
    }

    /// Adds one camera frame to the feature frame under way.
    fn add(&mut self, taxels: &[u32; TAXELS], store: &mut impl TaxelStore) -> Option<FeatureFrame> {
        store.add(taxels, self.present == 0);
        self.started = true;
        self.present += 1;
        for (line, sum) in self.lines.iter_mut().zip(line_sums(taxels)) {
            *line = line.saturating_add(sum);
        }
        self.complete(store)
    }

    /// Forgets the rows of a frame whose rest will not arrive, and counts it as lost.
    pub fn abandon_frame(&mut self) -> Loss {
        self.abandon_frame_of(&mut NoTaxels)
    }

    /// Forgets the rows of a frame whose rest will not arrive. `store` takes note of it.
    pub(crate) fn abandon_frame_of(&mut self, store: &mut impl TaxelStore) -> Loss {
        self.accumulators.abandon_frame();
        self.lose(1, store)
    }

    /// Keeps the place of `frames` lost camera frames in time.
    ///
    /// Frames lost before the first frame have no place. A frame that is under way in stripes stays so:
    /// [`FeatureStream::abandon_frame`] gives it up.
    pub fn push_lost(&mut self, frames: u64) -> Loss {
        self.push_lost_of(frames, &mut NoTaxels)
    }

    /// Keeps the place of `frames` lost camera frames in time. `store` takes note of them.
    pub(crate) fn push_lost_of(&mut self, frames: u64, store: &mut impl TaxelStore) -> Loss {
        if frames > 0 {
            self.accumulators.forget_taxels();
        }
        self.lose(frames, store)
    }

    fn lose(&mut self, frames: u64, store: &mut impl TaxelStore) -> Loss {
        let size = self.camera().rate().frames_added();
        let room = u64::from(size - self.present - self.lost);
        if !self.started {
            return Loss { has_missing_frames: None, frames: 0 };
        }
        let Some(beyond) = frames.checked_sub(room) else {
            self.lost += frames as u32;
            return Loss { has_missing_frames: None, frames: 0 };
        };
        self.lost += room as u32;
        let has_missing_frames = self.complete(store);
        let groups = beyond.checked_div(u64::from(size)).unwrap_or(0);
        self.lost = (beyond - groups * u64::from(size)) as u32;
        let frames = groups + u64::from(has_missing_frames.is_none());
        store.skip(frames);
        Loss { has_missing_frames, frames }
    }

    /// Returns the feature frame if all its camera frames have arrived or are lost; `None` if all are lost.
    fn complete(&mut self, store: &mut impl TaxelStore) -> Option<FeatureFrame> {
        if self.present + self.lost < self.camera().rate().frames_added() {
            return None;
        }
        let (present, lost) = (u64::from(self.present), u64::from(self.lost));
        let lines = core::mem::take(&mut self.lines);
        (self.present, self.lost) = (0, 0);
        let lines = if lost == 0 {
            lines
        } else if present == 0 {
            return None;
        } else {
            // The mean of the frames that arrived stands for each that did not.
            lines.map(|sum| {
                (u64::from(sum) * (present + lost) * 2 + present).checked_div(2 * present).unwrap_or(0) as u32
            })
        };
        store.complete(lost > 0);
        Some(FeatureFrame { features: self.scale.features(&lines), has_missing_frames: lost > 0 })
    }
}
