//! Keeps what the screen shows of a board: its features, events, motion, faults and its own state.

use std::sync::Mutex;

use super::state::{About, State};
use super::{ViewedSensor, locked};
use wstac_host::error::Error;
use wstac_host::monitor::line::{BoardLine, LineStep};
use wstac_host::monitor::{Report, telemetry};
use wstac_host::output::Output;
use wstac_host::plural::counted;

pub(crate) struct BoardView {
    line: BoardLine,
    /// The number of the frame behind the last one with features.
    next: u64,
}

impl BoardView {
    /// Creates the sensor of a line that asks for features and motion.
    pub(crate) fn new(line: BoardLine) -> Self {
        Self { line, next: 0 }
    }
}

impl ViewedSensor for BoardView {
    fn state(&self) -> State {
        let about = format!("board at {}", self.line.name());
        State { missing: "a board sends none", ..State::new(about, true, "– fps".to_owned()) }
    }

    fn step(&mut self, state: &Mutex<State>) -> Result<bool, Error> {
        let (next, clock, name) = (&mut self.next, self.line.monitor().clock_match(), self.line.name().to_owned());
        let step = self.line.step(|report| {
            let mut state = locked(state);
            match report {
                Report::Output(output) => {
                    if let Output::Features(frame) = &output {
                        // Frames without features; fewer if the board has started again.
                        state.add_gaps(frame.frame.checked_sub(*next).filter(|_| *next > 0).unwrap_or(0));
                        *next = frame.frame.saturating_add(1);
                    }
                    state.take(&output);
                }
                Report::LostEvents(lost) => state.say(About::Trouble, format!("{} lost", counted(lost, "event"))),
                Report::Note(text) => state.say(About::Trouble, text),
                Report::Telemetry(found) => {
                    state.about = format!("board at {name}: {}", telemetry::in_words(&found, clock));
                }
                Report::Request(_) => {}
            }
            Ok::<(), Error>(())
        })?;
        let mut state = locked(state);
        if let (Output::End(end), true, LineStep::GoesOn) =
            (self.line.monitor().finish(), self.line.monitor().heard(), step)
        {
            (state.frame, state.dropped) = (end.frames, end.dropped);
            let doing = format!("baseline {}", end.frames);
            state.doing =
                if end.baseline_complete { (About::Note, "watching".into()) } else { (About::Trouble, doing) };
        }
        Ok(step == LineStep::GoesOn)
    }

    fn rezero(&mut self, state: &mut State) {
        state.say(About::Note, "a board gathers its baseline when it starts".to_owned());
    }
}
