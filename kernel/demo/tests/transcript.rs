//! A whole session as text: every kind of command, and frames of the running demo by their checksums.
//!
//! `transcript.txt` is what a person at the serial line would see, without the checksums of lines. Each line
//! is easy to read, and a change in any answer, in the overlay or in the split view changes the transcript.
//! After an intended change, look at the difference, and run
//! `UPDATE_EXPECT=1 cargo test -p demo --test transcript`.

mod common;

use std::fmt::Write;

use common::{ask, memory};
use demo::Demo;
use expect_test::expect_file;
use protocol::Reception;
use vga::Vga;

/// The session's steps. `tick N` shows the running demo's frame of a tick, if it is due; `frame-time N` sets
/// how many microseconds the frame needed; `key` sends scan codes; `lose` sets losses of the keyboard and the
/// serial line; `#` begins a comment; everything else is a command.
const SESSION: &str = include_str!("session.txt");

#[test]
fn a_session_gives_the_transcript() {
    let mut memory = memory();
    let mut demo = Demo::new(&mut memory, Vga::new(), None).unwrap();
    let (mut transcript, mut tick) = (String::new(), 0);
    for line in SESSION.lines() {
        writeln!(transcript, "> {line}").unwrap();
        let (word, rest) = line.split_once(' ').unwrap_or((line, ""));
        match word {
            "#" => {}
            "tick" => {
                tick = rest.parse().unwrap();
                if demo.is_due(tick) {
                    let mut write = |line: std::fmt::Arguments<'_>| {
                        writeln!(transcript, "{line}").unwrap();
                    };
                    demo.present(tick, &mut write);
                } else {
                    writeln!(transcript, "(not due)").unwrap();
                }
                assert_eq!(demo.bus().take_faults(), [], "{line}");
            }
            "frame-time" => demo.add_frame_time(rest.parse().unwrap()),
            "key" => {
                for code in rest.split(' ') {
                    demo.key(u8::from_str_radix(code, 16).unwrap(), tick);
                }
            }
            "lose" => {
                demo.set_lost_keys(3);
                demo.set_reception(Reception {
                    overruns: 1,
                    damaged: 2,
                    full: 4,
                });
            }
            _ => {
                for answer in ask(&mut demo, line, tick) {
                    writeln!(transcript, "{answer}").unwrap();
                }
            }
        }
    }
    expect_file!["transcript.txt"].assert_eq(&transcript);
}
