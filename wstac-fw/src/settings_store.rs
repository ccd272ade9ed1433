//! The settings that a board uses: those that are compiled in, or those that a host has set. And learned textures.

#[cfg(feature = "settings")]
use core::ops::Range;

#[cfg(all(feature = "settings", not(feature = "models")))]
use embedded_storage_async::nor_flash::NorFlash as Storage;
use wstac_core::features::Floor;
use wstac_core::layout::Layout;
use wstac_core::paper::trigger::TriggerConfig;
#[cfg(feature = "settings")]
use wstac_core::rate::FrameRate;
use wstac_core::wire::Request;
#[cfg(feature = "models")]
use wstac_core::wire::{BoardModel, ModelRefusal, ModelStep};
#[cfg(feature = "settings")]
use wstac_core::wire::{Message, Refusal, Settings, SettingsInUse};

#[cfg(feature = "models")]
use crate::models::{InPlace as Storage, SentModels, accepted};
use crate::reader::Publisher;
#[cfg(feature = "settings")]
use crate::settings;
#[cfg(feature = "learn")]
use crate::settings::KeptTexture;
use crate::setup;

/// The settings in use.
pub trait SettingsStore {
    /// Returns the layout, the darkness floor and the trigger.
    fn parameters(&self) -> (Layout, Floor, TriggerConfig);

    /// Takes the longest exposure in lines of the sensor that was found. A longer one is shortened, but not in the
    /// flash.
    fn limit_exposure(&mut self, longest: u16) {
        let _ = longest;
    }

    /// Returns the exposure in lines, if it is not that of the sensor's table.
    fn exposure(&self) -> Option<u16> {
        None
    }

    /// Answers requests about settings.
    fn answer(&mut self, request: Request, line: &mut impl Publisher);

    /// Returns whether others are to be used, which takes a new start.
    fn wants_restart(&self) -> bool {
        false
    }

    /// Returns the learned texture at a place.
    #[cfg(feature = "learn")]
    fn texture(&mut self, _place: u8) -> Option<KeptTexture> {
        None
    }

    /// Keeps a learned texture at a place, or forgets it, which takes a new start. Returns whether that was done.
    #[cfg(feature = "learn")]
    fn keep_texture(&mut self, _place: u8, _texture: Option<&KeptTexture>) -> bool {
        false
    }

    /// Returns the model that a host has sent. It is to be called once.
    #[cfg(feature = "models")]
    fn model(&mut self) -> Option<setup::Kind> {
        None
    }

    /// Does what is to be done about models between frames, and returns what the host has to know of it. If another
    /// model is kept and `is_rest` says that no event is under way, it wants a new start.
    #[cfg(feature = "models")]
    fn keep_model(&mut self, _is_rest: bool) -> Option<Message<'static>> {
        None
    }
}

/// Settings that are compiled in.
pub struct FixedSettings(Layout);

impl FixedSettings {
    /// Creates them with this layout.
    pub fn new(layout: Layout) -> Self {
        Self(layout)
    }
}

impl SettingsStore for FixedSettings {
    fn parameters(&self) -> (Layout, Floor, TriggerConfig) {
        (self.0, setup::FLOOR, setup::TRIGGER)
    }

    #[cfg(not(feature = "models"))]
    fn answer(&mut self, _: Request, _: &mut impl Publisher) {}

    #[cfg(feature = "models")]
    fn answer(&mut self, request: Request, line: &mut impl Publisher) {
        let step = match request {
            Request::Model => ModelStep::Rest,
            Request::SendModel(_) | Request::ModelPiece(_) | Request::ForgetModel => {
                ModelStep::Refused(ModelRefusal::NoMemory)
            }
            _ => return,
        };
        let in_use = setup::MODEL.map(setup::Kind::checksum);
        line.send(&Message::Model(BoardModel::new(in_use, false, accepted(0), step)));
    }
}

/// Settings that a host has set, or those compiled in, with the flash that keeps the former.
#[cfg(feature = "settings")]
pub struct KeptSettings<F> {
    flash: F,
    range: Range<u32>,
    /// The layout in use, whose frames are those of the board.
    layout: Layout,
    rate: FrameRate,
    /// The longest exposure in lines.
    longest: u16,
    settings: Settings,
    /// Whether a host has set them.
    is_set: bool,
    wants_restart: bool,
    #[cfg(feature = "models")]
    models: SentModels,
}

#[cfg(feature = "settings")]
impl<F: Storage> KeptSettings<F> {
    /// Takes the settings in a range of a flash, if there are any that this program can use. The others have this
    /// layout. The sensor's exposure has at most `longest` lines.
    pub fn new(mut flash: F, range: Range<u32>, layout: Layout, rate: FrameRate, longest: u16) -> Self {
        let kept = settings::usable(&mut flash, range.clone(), layout.frame(), rate, longest);
        let compiled_in = (Settings::new(&layout, setup::FLOOR, setup::TRIGGER, None), layout);
        let (settings, layout) = kept.unwrap_or(compiled_in);
        Self {
            flash,
            range,
            layout,
            rate,
            longest,
            settings,
            is_set: kept.is_some(),
            wants_restart: false,
            #[cfg(feature = "models")]
            models: SentModels::default(),
        }
    }

    fn keep(&mut self, settings: &Settings) -> Result<(), Refusal> {
        settings::check(settings, self.layout.frame(), self.rate, self.longest)?;
        settings::keep(&mut self.flash, self.range.clone(), Some(settings))
    }
}

#[cfg(feature = "settings")]
impl<F: Storage> SettingsStore for KeptSettings<F> {
    fn parameters(&self) -> (Layout, Floor, TriggerConfig) {
        (self.layout, self.settings.floor, self.settings.trigger)
    }

    fn limit_exposure(&mut self, longest: u16) {
        self.longest = longest;
        self.settings.exposure = self.settings.exposure.map(|lines| lines.min(longest));
    }

    fn exposure(&self) -> Option<u16> {
        self.settings.exposure
    }

    fn answer(&mut self, request: Request, line: &mut impl Publisher) {
        let answer = match request {
            Request::Settings => {
                line.send(&Message::Settings(SettingsInUse::new(self.settings, self.is_set)));
                return;
            }
            Request::Set(settings) => self.keep(&settings),
            Request::Forget => settings::keep(&mut self.flash, self.range.clone(), None),
            #[cfg(feature = "models")]
            request => return self.models.request(request),
            #[cfg(not(feature = "models"))]
            _ => return,
        };
        if let Err(refusal) = answer {
            defmt::error!("settings are refused: {}", refusal);
        }
        self.wants_restart |= answer.is_ok();
        line.send(&Message::Set(answer));
    }

    fn wants_restart(&self) -> bool {
        self.wants_restart
    }

    #[cfg(feature = "learn")]
    fn texture(&mut self, place: u8) -> Option<KeptTexture> {
        settings::load_texture(&mut self.flash, self.range.clone(), place)
    }

    #[cfg(feature = "learn")]
    fn keep_texture(&mut self, place: u8, texture: Option<&KeptTexture>) -> bool {
        let is_kept = settings::keep_texture(&mut self.flash, self.range.clone(), place, texture);
        // Events that are not acknowledged have the names, so a name goes with a new start.
        self.wants_restart |= is_kept && texture.is_none();
        is_kept
    }

    #[cfg(feature = "models")]
    fn model(&mut self) -> Option<setup::Kind> {
        self.models.load(&mut self.flash, setup::MODEL.map(setup::Kind::checksum))
    }

    #[cfg(feature = "models")]
    fn keep_model(&mut self, is_rest: bool) -> Option<Message<'static>> {
        let told = self.models.step(&mut self.flash);
        self.wants_restart |= self.models.has_other() && is_rest;
        told
    }
}
