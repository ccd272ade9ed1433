//! Tests that bytes outside the taxels are never read. Their pages are protected, so a read would end the process.

use std::ptr;

use wstac_core::green::GreenChannel;
use wstac_core::green::bayer::{Bayer, BayerOrder};
use wstac_core::green::gray::Gray;
use wstac_core::green::packed_rgb::{Rgbx32, Xrgb32};
use wstac_core::green::packed_ycbcr::{Uyvy, Yuyv};
use wstac_core::green::planar_ycbcr::{Nv12, Yu12, Yuv422p, Yuv444p};
use wstac_core::green::rgb565::Rgb565;
use wstac_core::green::words::Y16;
use wstac_core::green::ycbcr::{Exact, Linear, YcbcrEncoding};
use wstac_core::layout::{FrameSize, Layout};
use wstac_core::rate::FrameRate;
use wstac_core::taxels::{FrameGeometry, TaxelSums};

/// A frame with protected pages.
struct Guarded {
    start: *mut u8,
    bytes: usize,
}

fn page() -> usize {
    // SAFETY: asks for a number.
    usize::try_from(unsafe { libc::sysconf(libc::_SC_PAGESIZE) }).unwrap()
}

impl Guarded {
    /// Creates `pages` pages of bytes that are `level`, of which only those with `is_open` can be read.
    fn new(pages: usize, level: u8, is_open: impl Fn(usize) -> bool) -> Self {
        let bytes = pages * page();
        let (read_write, private) = (libc::PROT_READ | libc::PROT_WRITE, libc::MAP_PRIVATE | libc::MAP_ANONYMOUS);
        // SAFETY: a new mapping; nothing else points to it.
        let start = unsafe { libc::mmap(ptr::null_mut(), bytes, read_write, private, -1, 0) };
        assert_ne!(start, libc::MAP_FAILED);
        let start = start.cast::<u8>();
        // SAFETY: the mapping has `bytes` bytes and is still writable.
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

/// Returns the signal that ends a child process which sums this frame; 0 if it survives.
fn signal_of_child<G: GreenChannel>(camera: FrameGeometry<G>, frame: &Guarded) -> i32 {
    // SAFETY: the child only reads, and exits without returning; no other thread's locks are needed for that.
    unsafe {
        let child = libc::fork();
        assert!(child >= 0);
        if child == 0 {
            let summed = TaxelSums::new(camera).push_frame(frame.bytes()).is_ok();
            libc::_exit(i32::from(!summed));
        }
        let mut status = 0;
        assert_eq!(libc::waitpid(child, &raw mut status, 0), child);
        assert!(libc::WIFSIGNALED(status) || libc::WEXITSTATUS(status) == 0, "the child could not sum");
        if libc::WIFSIGNALED(status) { libc::WTERMSIG(status) } else { 0 }
    }
}

/// Widths of taxels in pixels, and the column of a page that they start at if they do not end with it. No vector fits
/// into the first. The rows of the others are vectors in every format, those of chroma included, and the last starts
/// within a pair of pixels.
const TAXELS: [(u16, usize); 3] = [(8, 0), (72, 0), (73, 1)];

/// Returns taxels of `width` × 2 pixels, one in every third page of a frame whose rows are `pages_per_row` pages: at
/// column `first` of the page or at its end.
fn camera<G: GreenChannel>(
    green: G,
    (width, first): (u16, usize),
    bytes_per_pixel: usize,
    pages_per_row: usize,
    even_rows: bool,
) -> (FrameGeometry<G>, Layout) {
    let pixels_per_page = page() / bytes_per_pixel;
    let size = FrameSize::new((pages_per_row * pixels_per_page) as u32, 24).unwrap();
    let corners = core::array::from_fn(|taxel| {
        let (row, column) = (taxel / 5, taxel % 5);
        let x = (3 * column + 1) % pages_per_row * pixels_per_page
            + [first, pixels_per_page - usize::from(width)][taxel % 2];
        let y = 4 * row + if even_rows { 2 } else { 3 };
        [x as u16, y as u16]
    });
    let layout = Layout::new(size, [width, 2], corners).unwrap();
    let camera = FrameGeometry::new(green, layout, FrameRate::NOMINAL).unwrap();
    assert_eq!(camera.bytes_per_row(), pages_per_row * page());
    (camera, layout)
}

/// Returns whether a page of `row` at `page_of_row` has pixels of a taxel, whose rows are `per` frame rows each.
fn is_touched(layout: &Layout, row: usize, page_of_row: usize, bytes_per_pixel: usize, per: usize) -> bool {
    layout.corners().iter().any(|&[x, y]| {
        let rows = usize::from(y) / per..=(usize::from(y) + 1) / per;
        rows.contains(&row) && usize::from(x) * bytes_per_pixel / page() == page_of_row
    })
}

/// Sums a frame with every untouched page protected. Then protects one touched page as well, which must end a child.
fn check<G: GreenChannel>(
    camera: FrameGeometry<G>,
    pages: usize,
    level: u8,
    expected: u32,
    touched: impl Fn(usize) -> bool,
) {
    let open: Vec<usize> = (0..pages).filter(|&number| touched(number)).collect();
    assert!(open.len() >= 10 && open.len() < pages / 2, "{} of {pages} pages are touched", open.len());
    let frame = Guarded::new(pages, level, &touched);
    assert_eq!(signal_of_child(camera, &frame), 0, "bytes outside the taxels are read");
    assert_eq!(TaxelSums::new(camera).push_frame(frame.bytes()).unwrap(), [expected; 25]);
    // Touched pages matter: a read of one is noticed if it is protected. Each costs a process, so these are some.
    for &closed in open.iter().step_by(6) {
        let frame = Guarded::new(pages, level, |number| touched(number) && number != closed);
        assert_eq!(signal_of_child(camera, &frame), libc::SIGSEGV, "page {closed} is not read, or not guarded");
    }
}

/// Returns taxels of whole cells, and the number of pixels of each.
fn taxels(cell: u16) -> impl Iterator<Item = ((u16, usize), u32)> {
    TAXELS.into_iter().filter(move |(width, _)| width % cell == 0).map(|taxel| (taxel, 2 * u32::from(taxel.0)))
}

/// Tests packed formats: one kind of row, `pages_per_row` pages each. `green_of` is the sum of this many pixels.
fn check_packed<G: GreenChannel>(green: G, bytes_per_pixel: usize, level: u8, green_of: impl Fn(u32) -> u32) {
    let even_rows = green.cell() == 2;
    let pages = if bytes_per_pixel == 1 { 4 } else { 7 };
    for (place, pixels) in taxels(green.cell()) {
        let (camera, layout) = camera(green, place, bytes_per_pixel, pages, even_rows);
        let touched = |number| is_touched(&layout, number / pages, number % pages, bytes_per_pixel, 1);
        check(camera, pages * 24, level, green_of(pixels), touched);
    }
}

/// Returns the sum of `pixels` pixels of Y = Cb = Cr = 128, a green of 85/73 · 112 = 130.41: 130 each if exact.
fn exact(pixels: u32) -> u32 {
    130 * pixels
}

/// Returns the sum of the linear method, which is rounded once.
fn linear(pixels: u32) -> u32 {
    (2 * 85 * 112 * pixels + 73) / (2 * 73)
}

#[test]
fn bytes_outside_the_taxels_are_never_read_in_packed_formats() {
    // Half the pixels of a Bayer mosaic are green. 0x0707 is 1799, and a green of 227 as RGB565.
    let color = YcbcrEncoding::default();
    check_packed(Gray, 1, 7, |pixels| pixels * 7);
    check_packed(Y16::default(), 2, 7, |pixels| pixels * 1799);
    check_packed(Rgbx32::default(), 4, 7, |pixels| pixels * 7);
    check_packed(Xrgb32::default(), 4, 7, |pixels| pixels * 7);
    check_packed(Rgb565, 2, 7, |pixels| pixels * 227);
    check_packed(Bayer::<8>::new(BayerOrder::Rggb), 1, 7, |pixels| pixels / 2 * 7);
    check_packed(Bayer::<12>::new(BayerOrder::Grbg), 2, 7, |pixels| pixels / 2 * 1799);
    check_packed(Yuyv::new(Exact::new(color)), 2, 128, exact);
    check_packed(Yuyv::new(Linear::new(color)), 2, 128, linear);
    check_packed(Uyvy::new(Linear::new(color)), 2, 128, linear);
}

/// Tests formats of luma, then rows of Cb Cr pairs.
fn check_pairs<G: GreenChannel>(green: G, green_of: impl Fn(u32) -> u32) {
    for (place, pixels) in taxels(1) {
        let (camera, layout) = camera(green, place, 1, 4, true);
        check(camera, 4 * 36, 128, green_of(pixels), |number| match number / 4 {
            row @ 0..24 => is_touched(&layout, row, number % 4, 1, 1),
            row => is_touched(&layout, row - 24, number % 4, 1, 2),
        });
    }
}

#[test]
fn bytes_outside_the_taxels_are_never_read_in_nv12() {
    check_pairs(Nv12::new(Exact::new(YcbcrEncoding::default())), exact);
    check_pairs(Nv12::new(Linear::new(YcbcrEncoding::default())), linear);
}

/// Tests planes of luma, Cb and Cr, with chroma rows of half as many pages for every `per` rows of luma.
fn check_planes<G: GreenChannel>(green: G, per: usize, green_of: impl Fn(u32) -> u32) {
    for (place, pixels) in taxels(1) {
        let (camera, layout) = camera(green, place, 1, 4, true);
        let plane = 2 * 24 / per;
        check(camera, 4 * 24 + 2 * plane, 128, green_of(pixels), |number| {
            let Some(in_chroma) = number.checked_sub(4 * 24) else {
                return is_touched(&layout, number / 4, number % 4, 1, 1);
            };
            // Two pages of luma share one of chroma.
            let (row, page) = (in_chroma % plane / 2, in_chroma % 2);
            (0..2).any(|half| is_touched(&layout, row, 2 * page + half, 1, per))
        });
    }
}

#[test]
fn bytes_outside_the_taxels_are_never_read_in_planar_formats() {
    let color = YcbcrEncoding::default();
    check_planes(Yu12::new(Exact::new(color)), 2, exact);
    check_planes(Yu12::new(Linear::new(color)), 2, linear);
    check_planes(Yuv422p::new(Exact::new(color)), 1, exact);
    check_planes(Yuv422p::new(Linear::new(color)), 1, linear);
    for (place, pixels) in taxels(1) {
        let (camera, layout) = camera(Yuv444p::new(Exact::new(color)), place, 1, 4, false);
        let touched = |number: usize| is_touched(&layout, number / 4 % 24, number % 4, 1, 1);
        check(camera, 3 * 4 * 24, 128, exact(pixels), touched);
    }
}
