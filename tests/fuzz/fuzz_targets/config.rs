//! Reads any text as a configuration file. The result is an error with a message, or a configuration that builds or
//! reports why it does not.
#![no_main]

use libfuzzer_sys::fuzz_target;
use wstac_core::green::any::PixelFormat;
use wstac_core::layout::FrameSize;
use wstac_core::rate::FrameRate;
use wstac_host::config::Config;
use wstac_host::source::StreamInfo;

fuzz_target!(|text: &str| {
    let config = match Config::parse(text) {
        Ok(config) => config,
        Err(error) => return assert!(!error.message().is_empty()),
    };
    let size = FrameSize::new(640, 480).expect("a size");
    // A configuration that cannot be built has a message.
    if let Err(error) = config.layout(size) {
        assert!(!error.to_string().is_empty());
    }
    if let Err(error) = config.layout.check_frame(size) {
        assert!(!error.is_empty());
    }
    if let Err(error) = config.trigger() {
        assert!(!error.to_string().is_empty());
    }
    let errors = [config.durations(FrameRate::NOMINAL).err(), config.following().err()];
    for error in errors.into_iter().flatten() {
        assert!(!error.to_string().is_empty());
    }
    if let Err(error) = config.law_of(&StreamInfo::new("", size, PixelFormat::Gray, FrameRate::NOMINAL)) {
        assert!(!error.message().is_empty());
    }
});
