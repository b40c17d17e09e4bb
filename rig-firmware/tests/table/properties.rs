//! What holds for any bytes and any sequence of moves, holds and resumes.

use proptest::prelude::*;

use relit_test_support::firmware::{Edge, Table, extremes};

const ACCELERATION: f64 = 36.0 * 88.889;

/// Pieces of lines: random bytes alone would hardly ever mean something.
const PIECES: [&str; 37] = [
    "G0", "G1", "G4", "G20", "G21", "G53", "G90", "G91", "G92", "X", "F", "P", "N", "-", "1", "20",
    "360", "0.5", "99999999", "\n", "\n", "\r\n", " ", "(", ")", ";", "*", "$", "$H", "$X", "$J=",
    "$I", "$$", "=", "N0*1D0F", "~", "!",
];

fn noise() -> impl Strategy<Value = Vec<u8>> {
    let piece = prop_oneof![
        4 => prop::sample::select(&PIECES[..]).prop_map(|piece| piece.as_bytes().to_vec()),
        1 => any::<u8>().prop_map(|byte| vec![byte]),
    ];
    prop::collection::vec(piece, 0..120).prop_map(|pieces| pieces.concat())
}

#[derive(Debug, Clone, Copy)]
enum Deed {
    Move { x: i32, feed: u32 },
    Wait(u64),
    Hold,
    Resume,
}

fn deeds() -> impl Strategy<Value = Vec<Deed>> {
    let deed = prop_oneof![
        3 => (-20_000_i32..20_000, 20_u32..3000).prop_map(|(x, feed)| Deed::Move { x, feed }),
        3 => (1_u64..800).prop_map(Deed::Wait),
        1 => Just(Deed::Hold),
        2 => Just(Deed::Resume),
    ];
    prop::collection::vec(deed, 1..24)
}

/// Stretches of steps in one direction.
fn stretches(edges: &[Edge]) -> impl Iterator<Item = &[Edge]> {
    let mut forward = None;
    edges.chunk_by(move |one, next| {
        let direction = next.position > one.position;
        let same = forward.is_none_or(|before| before == direction);
        forward = same.then_some(direction);
        same
    })
}

/// That neither speed nor acceleration is above its limit, and every stretch starts and ends slow.
fn check_limits(edges: &[Edge]) -> Result<(), TestCaseError> {
    for stretch in stretches(edges) {
        let (fastest, hardest) = extremes(stretch);
        prop_assert!(fastest < 36.0 * 88.889 * 1.002, "{fastest}");
        prop_assert!(hardest < ACCELERATION * 1.1, "{hardest}");
        let ends = [
            stretch.get(..2),
            stretch.last_chunk::<2>().map(|end| &end[..]),
        ];
        for pair in ends.into_iter().flatten() {
            // Two steps from rest, v^2 = 2 a 2.
            let (speed, _) = extremes(pair);
            prop_assert!(speed < 2.05 * ACCELERATION.sqrt(), "{speed}");
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(150) })]

    #[test]
    fn any_bytes_are_survived_and_move_nothing_without_an_accepted_line(bytes in noise()) {
        let mut table = Table::new();
        table.board.type_bytes(&bytes);
        let mut oks = 0;
        for _ in 0..400 {
            let before = table.board.turned;
            table.run_ms(2);
            oks += table.heard().iter().filter(|line| line.starts_with("ok")).count();
            let homing = table.status().starts_with("<Home");
            prop_assert!(table.board.turned == before || oks > 0 || homing);
        }
        table.board.press_emergency(true);
        table.run_ms(1);
        let stood = table.board.turned;
        table.run_ms(20);
        prop_assert_eq!(table.board.turned, stood);
    }

    #[test]
    fn wrong_lines_alone_never_move_the_table(bytes in noise()) {
        let mut table = Table::new();
        table.answer("G0 X999");
        // Locked: whatever comes, short of an unlock, moves nothing.
        let text = String::from_utf8_lossy(&bytes).replace(['X', 'x', 'H', 'h', '\x18'], "");
        table.board.type_bytes(text.as_bytes());
        table.run_ms(200);
        prop_assert!(table.board.edges.is_empty());
    }

    #[test]
    fn moves_holds_and_resumes_end_on_the_target_within_the_limits(deeds in deeds()) {
        let mut table = Table::new();
        table.ok("$20=0");
        let mut target = 0;
        for deed in deeds {
            match deed {
                Deed::Move { x, feed } => {
                    let line = format!("G1 X{}.{:03} F{feed}\n", x / 1000, x.abs() % 1000);
                    target = if x < 0 && x / 1000 == 0 { -x } else { x };
                    table.say(line.as_bytes());
                    // A full queue in a hold takes no more lines.
                    if table.board.stepper.free() == 0 {
                        table.say(b"~");
                        table.run_ms(3000);
                    }
                }
                Deed::Wait(ms) => table.run_ms(ms),
                Deed::Hold => table.board.hear(b'!'),
                Deed::Resume => table.board.hear(b'~'),
            }
        }
        table.run_ms(2);
        table.say(b"~");
        table.wait("Idle");
        let expected = (f64::from(target) * 88.889 / 1000.0).round() as i32;
        prop_assert_eq!(table.steps(), expected);
        prop_assert_eq!(table.board.turned, expected);
        check_limits(&table.board.edges)?;
    }
}
