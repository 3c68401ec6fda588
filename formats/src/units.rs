//! Whether two units, as files write them, are the same.
//!
//! Spellings differ more than units do: `µK`, `uK` and `muK`; `K_CMB` and `Kcmb`; `m s**-1` and `m/s`. Nothing is
//! converted here.

/// The words that follow the kelvin of a brightness: whether it is thermodynamic or of Rayleigh and Jeans.
const KINDS: [&str; 3] = ["cmb", "rj", "thermo"];

/// Whether two units contradict each other. A unit without any letter says nothing and contradicts none, and a plain `K`
/// leaves open which kind of temperature it is.
pub fn differ(one: &str, other: &str) -> bool {
    let ((one, kind), (other, other_kind)) = (parts(one), parts(other));
    let open = one.is_empty() || other.is_empty();
    let same_kind = kind.is_none() || other_kind.is_none() || kind == other_kind;
    !(open || one == other && same_kind)
}

/// The factors of a unit in order, and the kind of its temperature where it names one.
fn parts(unit: &str) -> (Vec<String>, Option<&'static str>) {
    let mut plain: String = unit.chars().filter_map(usual).collect();
    plain = plain.replace("**", "").replace("micro", "u").replace("kelvin", "K").replace("Kelvin", "K");
    let mut kind = None;
    let mut factors = Vec::new();
    // Whatever a slash stands before is divided by.
    for (i, part) in plain.split('/').enumerate() {
        for (j, factor) in part.split([' ', '*', '.']).filter(|factor| !factor.is_empty()).enumerate() {
            let factor = factor.strip_prefix("mu").map_or(factor.to_owned(), |rest| format!("u{rest}"));
            let lower = factor.to_lowercase();
            let named = KINDS.into_iter().find(|kind| lower.ends_with(&format!("k{kind}")));
            kind = kind.or(named);
            let factor = factor[..factor.len() - named.map_or(0, str::len)].to_owned();
            factors.push(if i > 0 && j == 0 { divided_by(factor) } else { factor });
        }
    }
    factors.retain(|factor| factor.chars().any(|c| c.is_alphabetic() || c == '%'));
    factors.sort();
    (factors, kind)
}

/// A character in its usual form; nothing for those that only set off others.
fn usual(c: char) -> Option<char> {
    const RAISED: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    Some(match c {
        '_' | '^' | '(' | ')' | '{' | '}' | '[' | ']' | '$' | '\\' => return None,
        '\u{b5}' | '\u{3bc}' => 'u',
        '⁻' | '−' => '-',
        '·' | '⋅' => '.',
        c => RAISED.iter().position(|raised| *raised == c).map_or(c, |digit| char::from(b'0' + digit as u8)),
    })
}

/// A factor below the line.
fn divided_by(factor: String) -> String {
    if factor.ends_with(|c: char| c.is_ascii_digit()) {
        let letters = factor.trim_end_matches(|c: char| c.is_ascii_digit()).len();
        format!("{}-{}", &factor[..letters], &factor[letters..])
    } else {
        factor + "-1"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spellings_are_the_same_unit() {
        for (one, other) in [
            ("µK", "uK"),
            ("μK", "muK"),
            ("$\\mu$K$_{CMB}$", "uK_CMB"),
            ("uK_CMB", "muKcmb"),
            ("K_CMB", "Kcmb"),
            ("K", "K_CMB"),
            ("Kelvin", "K"),
            ("m s**-1", "m/s"),
            ("m s-1", "s⁻¹ m"),
            ("W/m2", "W m-2"),
            ("MJy/sr", "MJy sr^-1"),
            ("", "K"),
            ("1", "K"),
            ("-", "K"),
        ] {
            assert!(!differ(one, other) && !differ(other, one), "{one} and {other}");
        }
    }

    #[test]
    fn others_are_not() {
        for (one, other) in [
            ("uK", "K"),
            ("µK", "K_CMB"),
            ("mK", "uK"),
            ("K_CMB", "K_RJ"),
            ("mK", "MK"),
            ("m s-1", "m"),
            ("m", "km"),
            ("%", "K"),
        ] {
            assert!(differ(one, other) && differ(other, one), "{one} and {other}");
        }
    }
}
