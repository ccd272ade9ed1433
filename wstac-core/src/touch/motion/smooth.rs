//! The filter of light.

use core::cell::Cell;

/// Smooths twice by the filter [1 2 1] / 4 in place, and returns the highest value, at least 0. The first and last
/// values stand for those beyond them.
#[inline(never)]
pub(crate) fn smooth<T: Copy + Into<i32>>(line: &mut [T], of: impl Fn(i32) -> T) -> i32 {
    let line = Cell::from_mut(line).as_slice_of_cells();
    let [first, mut here] = [0, 1].map(|at| line.get(at).map_or(0, |light: &Cell<T>| light.get().into()));
    // Sums of two that follow each other, of light and of what is smoothed once.
    let mut pair = first + here;
    let mut once = (2 * first + pair + 2) >> 2;
    let (mut of_once, mut most) = (2 * once, 0);
    let mut put = |place: &Cell<T>, after: i32| {
        let next = once + after;
        let twice = (of_once + next + 2) >> 2;
        (once, of_once, most) = (after, next, twice.max(most));
        place.set(of(twice));
    };
    for [place, _, after] in line.array_windows() {
        let after = after.get().into();
        let next = here + after;
        put(place, (pair + next + 2) >> 2);
        (here, pair) = (after, next);
    }
    let last = (pair + 2 * here + 2) >> 2;
    for place in line.iter().skip(line.len().saturating_sub(2)) {
        put(place, last);
    }
    most
}
