use std::ffi::CStr;

use super::*;

fn said(handle: *const Wstac) -> String {
    // SAFETY: tests' handles are open, or null.
    let message = unsafe { CStr::from_ptr(wstac_error_message(handle)) };
    message.to_str().unwrap().to_owned()
}

/// A handle of frames of 10 × 10 GREY.
fn frames() -> *mut Wstac {
    let description = WstacFrames {
        width: 10,
        height: 10,
        format: c"GREY".as_ptr(),
        bytes_per_row: 0,
        fps_numerator: 0,
        fps_denominator: 0,
        bt709: false,
        full_range: false,
    };
    let mut handle = ptr::null_mut();
    // SAFETY: all are there.
    let status = unsafe { wstac_open_frames(&raw const description, ptr::null(), &raw mut handle) };
    assert_eq!(status, WstacStatus::Ok, "{}", said(ptr::null()));
    handle
}

#[test]
fn a_panic_does_not_leave_and_ends_the_handle() {
    let handle = frames();
    // SAFETY: the handle is open.
    let status = unsafe { with(handle, |_| panic!("on purpose")) };
    assert_eq!(status, WstacStatus::Panic);
    assert!(said(handle).contains("can only be closed"), "{}", said(handle));
    // SAFETY: as above.
    assert_eq!(unsafe { wstac_push_lost(handle, 1) }, WstacStatus::Panic);
    // SAFETY: as above; it is not used again.
    unsafe { wstac_close(handle) };
}

#[test]
fn a_panic_while_opening_is_a_status() {
    let mut handle = ptr::null_mut();
    // SAFETY: the place is there.
    let status = unsafe { open(&raw mut handle, || panic!("on purpose")) };
    assert_eq!((status, handle.is_null()), (WstacStatus::Panic, true));
}

#[test]
fn statuses_have_texts() {
    let text = |status| {
        // SAFETY: texts stay.
        unsafe { CStr::from_ptr(wstac_error_text(status)) }.to_str().unwrap()
    };
    let texts: std::collections::HashSet<_> = (0..=9).map(text).collect();
    assert_eq!(texts.len(), 10);
    for unknown in [-1, 10, i32::MIN, i32::MAX] {
        assert_eq!(text(unknown), "no status of this library");
    }
}
