//! Keeps what the screen shows of a board besides its outputs: faults and its own state.

use super::state::{About, State};
use wstac_host::monitor::{Report, telemetry};
use wstac_host::output::Output;
use wstac_host::source::StreamInfo;

/// Returns the state before the first report.
pub(super) fn state(info: &StreamInfo) -> State {
    State { missing: "a board sends none", ..State::new(about(info).to_owned(), true, "– fps".to_owned()) }
}

fn about(info: &StreamInfo) -> &str {
    info.about.trim_start_matches("a ")
}

/// Takes a report, but not its output. `next` is the number of the frame behind the last one with features.
pub(super) fn take(report: &Report, info: &StreamInfo, next: &mut u64, state: &mut State) {
    if let Some(message) = report.message() {
        state.say(About::Trouble, message.into());
    }
    match report {
        Report::Output(Output::Features(frame)) => {
            // Frames without features; fewer if the board has started again.
            state.add_gaps(frame.frame.checked_sub(*next).filter(|_| *next > 0).unwrap_or(0));
            *next = frame.frame.saturating_add(1);
        }
        Report::Telemetry(found, clock) => {
            state.about = format!("{}: {}", about(info), telemetry::in_words(found, *clock));
        }
        Report::Progress(stream) => {
            (state.frame, state.dropped) = (stream.frames, stream.dropped);
            let doing = format!("baseline {}", stream.frames);
            state.doing =
                if stream.baseline_complete { (About::Note, "watching".into()) } else { (About::Trouble, doing) };
        }
        Report::Output(_) | Report::Request(_) | Report::LostEvents(_) | Report::Note(_) => {}
    }
}
