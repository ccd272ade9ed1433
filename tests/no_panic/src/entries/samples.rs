//! Entry points for samples and their prefixes.

use wstac_core::features::Features;
use wstac_core::paper::early::SamplePrefix;
use wstac_core::paper::sample::Sample;
use wstac_core::pipeline::Update;

entries! {
    sample:
    new<'a>(frames: &'a [Features; 70]) -> Sample<'a> { Sample::from_frames(frames) }
    feature(sample: Sample<'_>, feature: usize) -> i64 { sample.feature(feature).map(i64::from).sum() }
    flat(sample: Sample<'_>) -> [i16; 700] { sample.flat() }
    copy_to(sample: Sample<'_>, flat: &mut [i16; 700]) -> () { sample.copy_to(flat) }
    frames(sample: Sample<'_>) -> usize { sample.frames().count() }
    prefix<'a>(update: &Update<'a>, frames: u8) -> Option<SamplePrefix<'a>> { update.prefix(frames) }
    beginning_flat(beginning: &SamplePrefix<'_>) -> [i16; 700] { beginning.flat() }
    beginning_copy_to(beginning: &SamplePrefix<'_>, flat: &mut [i16; 700]) -> () { beginning.copy_to(flat) }
}
