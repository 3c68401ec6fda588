//! Names of columns, variables and dimensions as people type them.
//!
//! The same name is what is meant; without it one that differs in nothing but case, hyphens and underscores. What is
//! done where several names are meant is left to the caller.

/// Whether two names differ in nothing but case, and `-` for `_`.
pub fn is_alike(one: &str, other: &str) -> bool {
    plain(one).eq(plain(other))
}

/// The letters by which names are compared.
fn plain(name: &str) -> impl Iterator<Item = char> {
    name.trim().chars().flat_map(char::to_lowercase).map(|c| if c == '-' { '_' } else { c })
}

/// The places of the names that are meant: all that are the same, or where there is none, all that are alike.
pub(crate) fn meant<'n>(names: impl Iterator<Item = &'n str> + Clone, wanted: &str) -> Vec<usize> {
    let those = |is: fn(&str, &str) -> bool| -> Vec<usize> {
        names.clone().enumerate().filter(|(_, name)| is(name, wanted)).map(|(i, _)| i).collect()
    };
    let same = those(|name, wanted| name == wanted);
    if same.is_empty() { those(is_alike) } else { same }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn case_hyphens_and_underscores_do_not_matter() {
        for other in ["EVQ_DIRECTION", "evq-direction", "Evq-Direction", " evq_direction "] {
            assert!(is_alike("EVQ_DIRECTION", other), "{other}");
        }
        for other in ["EVQDIRECTION", "EVQ DIRECTION", "EVQ_DIRECTIO", ""] {
            assert!(!is_alike("EVQ_DIRECTION", other), "{other}");
        }
    }

    #[test]
    fn the_same_name_comes_before_those_alike() {
        let names = ["t2m", "T2M", "sea-level", "Sea_Level", "x"];
        let meant = |wanted| meant(names.iter().copied(), wanted);
        assert_eq!(meant("t2m"), [0]);
        assert_eq!(meant("T2M"), [1]);
        assert_eq!(meant("t2M"), [0, 1]);
        assert_eq!(meant("sea_level"), [2, 3]);
        assert_eq!(meant("X"), [4]);
        assert!(meant("y").is_empty());
    }
}
