//! The controls that are locked, and their order: everything automatic first, then what it governed.

use v4l::v4l_sys as sys;

/// High dynamic range of the sensor, which the bindings do not know: number 36 of the camera class.
const HDR_SENSOR_MODE: u32 = 0x009a_0924;

/// The flicker of a room's lights, to which the camera adapts its exposure.
pub(super) const POWER_LINE_FREQUENCY: u32 = sys::V4L2_CID_POWER_LINE_FREQUENCY;

/// An automatic control that is switched off.
#[derive(Clone, Copy, Debug)]
pub(super) struct Switch {
    pub(super) id: u32,
    /// The value of the control when it is off.
    pub(super) off: i32,
    /// Other values with which nothing is automatic, if it cannot be off.
    pub(super) fixed: &'static [i32],
}

/// A number that keeps its value.
#[derive(Clone, Copy, Debug)]
pub(super) struct Value {
    pub(super) id: u32,
    /// The switches that change it while they are on.
    pub(super) governed_by: &'static [u32],
}

const fn switch(id: u32, off: i32) -> Switch {
    Switch { id, off, fixed: &[] }
}

const fn value(id: u32, governed_by: &'static [u32]) -> Value {
    Value { id, governed_by }
}

const EXPOSURE: &[u32] = &[sys::V4L2_CID_EXPOSURE_AUTO];
const GAIN: &[u32] = &[sys::V4L2_CID_AUTOGAIN, sys::V4L2_CID_EXPOSURE_AUTO];
const WHITE: &[u32] = &[sys::V4L2_CID_AUTO_WHITE_BALANCE, sys::V4L2_CID_AUTO_N_PRESET_WHITE_BALANCE];

/// The switches in order: those that govern most come first. The frame rate is made steady before the exposure is.
/// Otherwise an exposure longer than a frame would stay.
pub(super) const SWITCHES: [Switch; 16] = [
    switch(sys::V4L2_CID_EXPOSURE_AUTO_PRIORITY, 0),
    switch(sys::V4L2_CID_SCENE_MODE, 0),
    switch(HDR_SENSOR_MODE, 0),
    switch(sys::V4L2_CID_WIDE_DYNAMIC_RANGE, 0),
    switch(sys::V4L2_CID_BACKLIGHT_COMPENSATION, 0),
    switch(sys::V4L2_CID_EXPOSURE_AUTO, sys::v4l2_exposure_auto_type_V4L2_EXPOSURE_MANUAL as i32),
    switch(sys::V4L2_CID_ISO_SENSITIVITY_AUTO, 0),
    switch(sys::V4L2_CID_AUTOGAIN, 0),
    switch(sys::V4L2_CID_CHROMA_AGC, 0),
    switch(sys::V4L2_CID_AUTOBRIGHTNESS, 0),
    switch(sys::V4L2_CID_AUTO_N_PRESET_WHITE_BALANCE, 0),
    switch(sys::V4L2_CID_AUTO_WHITE_BALANCE, 0),
    switch(sys::V4L2_CID_HUE_AUTO, 0),
    switch(sys::V4L2_CID_FOCUS_AUTO, 0),
    switch(sys::V4L2_CID_IMAGE_STABILIZATION, 0),
    // The values off, 50 Hz and 60 Hz stay what they are; 3 is automatic.
    Switch { id: POWER_LINE_FREQUENCY, off: 0, fixed: &[1, 2] },
];

/// The numbers, which are set after all switches.
pub(super) const VALUES: [Value; 21] = [
    value(sys::V4L2_CID_EXPOSURE_ABSOLUTE, EXPOSURE),
    value(sys::V4L2_CID_EXPOSURE, EXPOSURE),
    value(sys::V4L2_CID_IRIS_ABSOLUTE, EXPOSURE),
    value(sys::V4L2_CID_ISO_SENSITIVITY, &[sys::V4L2_CID_ISO_SENSITIVITY_AUTO]),
    value(sys::V4L2_CID_GAIN, GAIN),
    value(sys::V4L2_CID_ANALOGUE_GAIN, GAIN),
    value(sys::V4L2_CID_DIGITAL_GAIN, GAIN),
    value(sys::V4L2_CID_CHROMA_GAIN, &[sys::V4L2_CID_CHROMA_AGC]),
    value(sys::V4L2_CID_WHITE_BALANCE_TEMPERATURE, WHITE),
    value(sys::V4L2_CID_RED_BALANCE, WHITE),
    value(sys::V4L2_CID_BLUE_BALANCE, WHITE),
    value(sys::V4L2_CID_FOCUS_ABSOLUTE, &[sys::V4L2_CID_FOCUS_AUTO]),
    value(sys::V4L2_CID_BRIGHTNESS, &[sys::V4L2_CID_AUTOBRIGHTNESS]),
    value(sys::V4L2_CID_BLACK_LEVEL, &[]),
    value(sys::V4L2_CID_CONTRAST, &[]),
    value(sys::V4L2_CID_SATURATION, &[]),
    value(sys::V4L2_CID_HUE, &[sys::V4L2_CID_HUE_AUTO]),
    value(sys::V4L2_CID_GAMMA, &[]),
    value(sys::V4L2_CID_SHARPNESS, &[]),
    value(sys::V4L2_CID_COLORFX, &[]),
    value(sys::V4L2_CID_BAND_STOP_FILTER, &[]),
];

/// Returns the identifiers of all controls that are locked, in order.
pub(super) fn ids() -> impl Iterator<Item = u32> {
    SWITCHES.iter().map(|switch| switch.id).chain(VALUES.iter().map(|value| value.id))
}
