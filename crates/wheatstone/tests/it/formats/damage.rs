//! Files as accidents and attackers leave them. The tests of the program damage with it as well.

use wheatstone::numeric::random::Random;

/// Pieces that readers trip over.
const PIECES: [&[u8]; 22] = [
    b"nan",
    b"inf",
    b"-1",
    b"1e308",
    b"99999999999999999999",
    b"0",
    b"",
    b"[",
    b"]",
    b"{",
    b"}",
    b":",
    b"- ",
    b"\n",
    b"'",
    b"\"",
    b"#",
    b",",
    b"\xff\xfe",
    b"(18446744073709551615, 9)",
    b"\xef\xbb\xbf",
    b"e",
];

/// Up to three changes: bytes, pieces, ends, copies of a part elsewhere.
pub(crate) fn damage(bytes: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..=random.below(3) {
        if bytes.is_empty() {
            return;
        }
        let at = random.below(bytes.len());
        match random.below(7) {
            0 => bytes[at] = random.below(256) as u8,
            1 => bytes.truncate(at),
            2 => {
                bytes.remove(at);
            }
            3 | 4 => {
                let piece = PIECES[random.below(PIECES.len())];
                bytes.splice(at..at, piece.iter().copied());
            }
            5 => {
                // A number in place of another.
                let end = at
                    + bytes[at..].iter().take_while(|b| b.is_ascii_digit() || **b == b'.').count();
                bytes.splice(at..end, PIECES[random.below(6)].iter().copied());
            }
            _ => {
                let end = (at + random.below(60)).min(bytes.len());
                let copy = bytes[at..end].to_vec();
                let to = random.below(bytes.len());
                bytes.splice(to..to, copy);
            }
        }
    }
}
