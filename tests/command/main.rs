//! Tests of the `wstac` command as a program of its own: what it prints, writes and refuses, and how it ends.

mod calibrate;
mod completions;
mod dataset;
mod escapes;
mod exit;
mod hostile;
mod inline;
mod mistakes;
mod model;
mod monitor;
mod motion;
mod names;
mod outputs;
mod pictures;
mod program;
mod progress;
mod recording;
mod records;
mod report;
mod scene;
mod serve;
mod sets;
mod shards;
mod signals;
mod texture;
mod train;
