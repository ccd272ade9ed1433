//! Bytes outside the taxels are never read: their pages cannot be read, and a read would end the process.

use std::ptr;

use wstac_core::green::Green;
use wstac_core::green::bayer::{Bayer, BayerOrder};
use wstac_core::green::grey::Grey;
use wstac_core::green::packed_rgb::{Rgbx32, Xrgb32};
use wstac_core::green::packed_ycbcr::{Uyvy, Yuyv};
use wstac_core::green::planar_ycbcr::{Nv12, Yu12, Yuv422p, Yuv444p};
use wstac_core::green::rgb565::Rgb565;
use wstac_core::green::words::Y16;
use wstac_core::green::ycbcr::{Colour, Exact, Linear};
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::rate::FrameRate;
use wstac_core::taxels::{Accumulators, Camera};

/// A frame of which some pages cannot be read.
struct Guarded {
    start: *mut u8,
    bytes: usize,
}

fn page() -> usize {
    // SAFETY: asks for a number.
    usize::try_from(unsafe { libc::sysconf(libc::_SC_PAGESIZE) }).unwrap()
}

impl Guarded {
    /// `pages` pages of bytes that are `level`, of which only those that `is_open` says can be read.
    fn new(pages: usize, level: u8, is_open: impl Fn(usize) -> bool) -> Self {
        let bytes = pages * page();
        let (read_write, private) = (libc::PROT_READ | libc::PROT_WRITE, libc::MAP_PRIVATE | libc::MAP_ANONYMOUS);
        // SAFETY: a new mapping; nothing else points to it.
        let start = unsafe { libc::mmap(ptr::null_mut(), bytes, read_write, private, -1, 0) };
        assert_ne!(start, libc::MAP_FAILED);
        let start = start.cast::<u8>();
        // SAFETY: the mapping has `bytes` bytes and can be written still.
        unsafe { ptr::write_bytes(start, level, bytes) };
        for number in (0..pages).filter(|&number| !is_open(number)) {
            // SAFETY: the page is one of this mapping's.
            let done = unsafe { libc::mprotect(start.add(number * page()).cast(), page(), libc::PROT_NONE) };
            assert_eq!(done, 0);
        }
        Self { start, bytes }
    }

    fn bytes(&self) -> &[u8] {
        // SAFETY: mapped until `self` is dropped. Reading a guarded page ends the process, which is the test.
        unsafe { std::slice::from_raw_parts(self.start, self.bytes) }
    }
}

impl Drop for Guarded {
    fn drop(&mut self) {
        // SAFETY: mapped by `new`, and not used after this.
        unsafe { libc::munmap(self.start.cast(), self.bytes) };
    }
}

/// The signal that ends a child process which sums this frame; 0 if it lives.
fn signal_of_child<G: Green>(camera: Camera<G>, frame: &Guarded) -> i32 {
    // SAFETY: the child only reads, and exits without returning; no other thread's locks are needed for that.
    unsafe {
        let child = libc::fork();
        assert!(child >= 0);
        if child == 0 {
            let summed = Accumulators::new(camera).push_frame(frame.bytes()).is_ok();
            libc::_exit(i32::from(!summed));
        }
        let mut status = 0;
        assert_eq!(libc::waitpid(child, &raw mut status, 0), child);
        assert!(libc::WIFSIGNALED(status) || libc::WEXITSTATUS(status) == 0, "the child could not sum");
        if libc::WIFSIGNALED(status) { libc::WTERMSIG(status) } else { 0 }
    }
}

/// Taxels of 8 × 2 pixels, one in every third page of a frame whose rows are `pages_per_row` pages.
fn camera<G: Green>(green: G, bytes_per_pixel: usize, pages_per_row: usize, even_rows: bool) -> (Camera<G>, Layout) {
    let pixels_per_page = page() / bytes_per_pixel;
    let size = FrameSize::new((pages_per_row * pixels_per_page) as u32, 24).unwrap();
    let corners = core::array::from_fn(|taxel| {
        let (row, column) = (taxel / 5, taxel % 5);
        let x = (3 * column + 1) % pages_per_row * pixels_per_page + [0, pixels_per_page - 8][taxel % 2];
        let y = 4 * row + if even_rows { 2 } else { 3 };
        [x as u16, y as u16]
    });
    let layout = Layout::new(size, [8, 2], corners).unwrap();
    let camera = Camera::new(green, layout, FrameRate::NOMINAL).unwrap();
    assert_eq!(camera.bytes_per_row(), pages_per_row * page());
    (camera, layout)
}

/// Whether a page of `row` at `page_of_row` holds pixels of a taxel, whose rows are `per` frame rows each.
fn is_touched(layout: &Layout, row: usize, page_of_row: usize, bytes_per_pixel: usize, per: usize) -> bool {
    layout.corners().iter().any(|&[x, y]| {
        let rows = usize::from(y) / per..=(usize::from(y) + 1) / per;
        rows.contains(&row) && usize::from(x) * bytes_per_pixel / page() == page_of_row
    })
}

/// Sums a frame with every untouched page guarded; then guards one touched page as well, and that must end a child.
fn check<G: Green>(camera: Camera<G>, pages: usize, level: u8, expected: u32, touched: impl Fn(usize) -> bool) {
    let open: Vec<usize> = (0..pages).filter(|&number| touched(number)).collect();
    assert!(open.len() >= 10 && open.len() < pages / 2, "{} of {pages} pages are touched", open.len());
    let frame = Guarded::new(pages, level, &touched);
    assert_eq!(signal_of_child(camera, &frame), 0, "bytes outside the taxels are read");
    assert_eq!(Accumulators::new(camera).push_frame(frame.bytes()).unwrap(), [expected; 25]);
    // Every touched page matters: with it guarded, a read of it is seen.
    for &closed in &open {
        let frame = Guarded::new(pages, level, |number| touched(number) && number != closed);
        assert_eq!(signal_of_child(camera, &frame), libc::SIGSEGV, "page {closed} is not read, or not guarded");
    }
}

/// Packed formats: one kind of row, `pages_per_row` pages each.
fn check_packed<G: Green>(green: G, bytes_per_pixel: usize, level: u8, expected: u32) {
    let even_rows = green.cell() == 2;
    let pages = if bytes_per_pixel == 1 { 4 } else { 7 };
    let (camera, layout) = camera(green, bytes_per_pixel, pages, even_rows);
    let touched = |number| is_touched(&layout, number / pages, number % pages, bytes_per_pixel, 1);
    check(camera, pages * 24, level, expected, touched);
}

#[test]
fn bytes_outside_the_taxels_are_never_read_in_packed_formats() {
    // Taxels have 16 pixels, of a Bayer mosaic 8 green ones. 0x0707 is 1799, and a green of 227 as RGB565.
    let colour = Colour::default();
    check_packed(Grey, 1, 7, 16 * 7);
    check_packed(Y16::default(), 2, 7, 16 * 1799);
    check_packed(Rgbx32::default(), 4, 7, 16 * 7);
    check_packed(Xrgb32::default(), 4, 7, 16 * 7);
    check_packed(Rgb565, 2, 7, 16 * 227);
    check_packed(Bayer::<8>::new(BayerOrder::Rggb), 1, 7, 8 * 7);
    check_packed(Bayer::<12>::new(BayerOrder::Grbg), 2, 7, 8 * 1799);
    // Y = Cb = Cr = 128 is a green of 130.41: 130 a pixel if exact, 2087 a taxel if linear.
    check_packed(Yuyv::new(Exact::new(colour)), 2, 128, 16 * 130);
    check_packed(Uyvy::new(Linear::new(colour)), 2, 128, 2087);
}

#[test]
fn bytes_outside_the_taxels_are_never_read_in_nv12() {
    let (camera, layout) = camera(Nv12::new(Exact::new(Colour::default())), 1, 4, true);
    check(camera, 4 * 36, 128, 16 * 130, |number| match number / 4 {
        row @ 0..24 => is_touched(&layout, row, number % 4, 1, 1),
        row => is_touched(&layout, row - 24, number % 4, 1, 2),
    });
}

/// Planes of luma, Cb and Cr, with chroma rows of half as many pages for every `per` rows of luma.
fn check_planes<G: Green>(green: G, per: usize, expected: u32) {
    let (camera, layout) = camera(green, 1, 4, true);
    let plane = 2 * 24 / per;
    check(camera, 4 * 24 + 2 * plane, 128, expected, |number| {
        let Some(in_chroma) = number.checked_sub(4 * 24) else {
            return is_touched(&layout, number / 4, number % 4, 1, 1);
        };
        // Two pages of luma share one of chroma.
        let (row, page) = (in_chroma % plane / 2, in_chroma % 2);
        (0..2).any(|half| is_touched(&layout, row, 2 * page + half, 1, per))
    });
}

#[test]
fn bytes_outside_the_taxels_are_never_read_in_planar_formats() {
    let colour = Colour::default();
    check_planes(Yu12::new(Exact::new(colour)), 2, 16 * 130);
    check_planes(Yuv422p::new(Linear::new(colour)), 1, 2087);
    let (camera, layout) = camera(Yuv444p::new(Exact::new(colour)), 1, 4, false);
    check(camera, 3 * 4 * 24, 128, 16 * 130, |number| is_touched(&layout, number / 4 % 24, number % 4, 1, 1));
}
