//! The colour maps. Which value has which of their colours is left to [`scale`](super::scale).

use std::f64::consts::{PI, TAU};
use std::str::FromStr;

use colorous::{BROWN_GREEN, CIVIDIS, GREYS, Gradient, INFERNO, MAGMA, PLASMA, PURPLE_ORANGE, RED_BLUE, VIRIDIS};

/// A colour map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Colours {
    /// Perceptually uniform, from dark to light.
    Viridis,
    /// Perceptually uniform, from dark to light.
    Magma,
    /// Perceptually uniform, from dark to light.
    Inferno,
    /// Perceptually uniform, from dark to light.
    Plasma,
    /// Perceptually uniform, from dark to light; the same to the colour-blind.
    Cividis,
    /// From black to white.
    Greys,
    /// Diverging: blue, white, red.
    BlueRed,
    /// Diverging: purple, white, orange.
    PurpleOrange,
    /// Diverging: brown, white, green.
    BrownGreen,
    /// Cyclic, in even steps: light, blue, dark, brown, light.
    Cyclic,
}

impl Colours {
    /// All of them, with their names.
    pub const ALL: [(Colours, &str); 10] = [
        (Colours::Viridis, "viridis"),
        (Colours::Magma, "magma"),
        (Colours::Inferno, "inferno"),
        (Colours::Plasma, "plasma"),
        (Colours::Cividis, "cividis"),
        (Colours::Greys, "greys"),
        (Colours::BlueRed, "blue-red"),
        (Colours::PurpleOrange, "purple-orange"),
        (Colours::BrownGreen, "brown-green"),
        (Colours::Cyclic, "cyclic"),
    ];

    /// Whether the middle is neutral and both ends are strong.
    pub fn are_diverging(self) -> bool {
        matches!(self, Colours::BlueRed | Colours::PurpleOrange | Colours::BrownGreen)
    }

    /// Red, green and blue at a place from 0 to 1.
    pub fn at(self, place: f64) -> [u8; 3] {
        let of = |gradient: Gradient, place: f64| {
            let colour = gradient.eval_continuous(place);
            [colour.r, colour.g, colour.b]
        };
        match self {
            Colours::Viridis => of(VIRIDIS, place),
            Colours::Magma => of(MAGMA, place),
            Colours::Inferno => of(INFERNO, place),
            Colours::Plasma => of(PLASMA, place),
            Colours::Cividis => of(CIVIDIS, place),
            Colours::Greys => of(GREYS, 1.0 - place),
            Colours::BlueRed => of(RED_BLUE, 1.0 - place),
            Colours::PurpleOrange => of(PURPLE_ORANGE, place),
            Colours::BrownGreen => of(BROWN_GREEN, place),
            Colours::Cyclic => cyclic(place),
        }
    }
}

impl FromStr for Colours {
    type Err = super::Error;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let found = Colours::ALL.iter().find(|(_, name)| name.eq_ignore_ascii_case(text));
        found.map(|(colours, _)| *colours).ok_or_else(|| super::Error::Colours {
            name: text.to_owned(),
            known: Colours::ALL.map(|(_, name)| name).to_vec(),
        })
    }
}

/// Lightness in the middle of the cyclic map's two arms, how far it goes to either side, and the arms' colourfulness
/// there.
const LIGHTNESS: (f64, f64) = (0.56, 0.33);
const CHROMA: f64 = 0.105;

/// Hues of the arms in OKLab, blue and brown: apart for the colour-blind too.
const HUES: [f64; 2] = [255.0, 55.0];

/// A closed way through OKLab: half an ellipse from light to dark, another back, in steps of even length.
fn cyclic(place: f64) -> [u8; 3] {
    let turn = along_ellipse(place.rem_euclid(1.0));
    let (sin, cos) = turn.sin_cos();
    let (lightness, chroma) = (LIGHTNESS.0 + LIGHTNESS.1 * cos, CHROMA * sin.abs());
    let hue = HUES[usize::from(sin < 0.0)].to_radians();
    from_oklab(lightness, chroma * hue.cos(), chroma * hue.sin())
}

/// The parameter of the ellipse at a share of its length. The first terms of a series in the axes' ratio do: colours
/// of eight bits cannot tell more.
fn along_ellipse(share: f64) -> f64 {
    let length = |turn: f64| {
        let steps = 64;
        let speed = |t: f64| (LIGHTNESS.1 * t.sin()).hypot(CHROMA * t.cos());
        (0..steps).map(|i| speed(turn * (f64::from(i) + 0.5) / f64::from(steps))).sum::<f64>() * turn / f64::from(steps)
    };
    let (half, whole) = (share % 0.5, length(PI));
    let (mut low, mut high) = (0.0, PI);
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        if length(middle) < 2.0 * half * whole { low = middle } else { high = middle }
    }
    if share < 0.5 { low } else { (low + PI).min(TAU) }
}

/// OKLab (Ottosson 2020) to sRGB of eight bits.
fn from_oklab(lightness: f64, a: f64, b: f64) -> [u8; 3] {
    let cone = |x: f64, y: f64| (lightness + x * a + y * b).powi(3);
    let (l, m, s) =
        (cone(0.3963377774, 0.2158037573), cone(-0.1055613458, -0.0638541728), cone(-0.0894841775, -1.2914855480));
    let linear = [
        4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
        -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
        -0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s,
    ];
    linear.map(|x: f64| {
        let encoded = if x <= 0.0031308 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
        (255.0 * encoded.clamp(0.0, 1.0)).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The lightness of a colour, by the luminance of sRGB.
    fn luminance([r, g, b]: [u8; 3]) -> f64 {
        let linear = |c: u8| (f64::from(c) / 255.0).powf(2.2);
        0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b)
    }

    #[test]
    fn names_are_read_back() {
        for (colours, name) in Colours::ALL {
            assert_eq!(name.parse::<Colours>().unwrap(), colours);
            assert_eq!(name.to_uppercase().parse::<Colours>().unwrap(), colours);
        }
        let error = "jet".parse::<Colours>().unwrap_err().to_string();
        assert!(error.contains("'jet'") && error.contains("viridis, magma") && error.contains("cyclic"), "{error}");
    }

    #[test]
    fn sequential_maps_grow_lighter_and_diverging_ones_are_lightest_in_the_middle() {
        for (colours, name) in Colours::ALL {
            let lights: Vec<f64> = (0..=50).map(|i| luminance(colours.at(f64::from(i) / 50.0))).collect();
            let grow = |lights: &[f64]| lights.windows(2).all(|pair| pair[1] > pair[0] - 0.002);
            if colours == Colours::Cyclic {
                assert_eq!(colours.at(0.0), colours.at(1.0));
            } else if colours.are_diverging() {
                let mut back = lights[25..].to_vec();
                back.reverse();
                assert!(grow(&lights[..=25]) && grow(&back) && lights[25] > 0.85, "{name}");
            } else {
                assert!(grow(&lights) && lights[50] > lights[0] + 0.5, "{name}");
            }
        }
        assert_eq!(Colours::Viridis.at(0.0), [68, 1, 84]);
        // Blue is below and red above.
        let ([r, _, b], [red, _, blue]) = (Colours::BlueRed.at(0.1), Colours::BlueRed.at(0.9));
        assert!(b > r && red > blue);
    }

    #[test]
    fn the_cyclic_map_has_even_steps() {
        // In the space that it is made in, whose distances are those that are seen.
        let at = |i: u16| {
            let turn = along_ellipse(f64::from(i % 100) / 100.0);
            let hue = HUES[usize::from(turn.sin() < 0.0)].to_radians();
            let chroma = CHROMA * turn.sin().abs();
            [LIGHTNESS.0 + LIGHTNESS.1 * turn.cos(), chroma * hue.cos(), chroma * hue.sin()]
        };
        let steps: Vec<f64> =
            (0..100).map(|i| at(i).iter().zip(at(i + 1)).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()).collect();
        let mean = steps.iter().sum::<f64>() / 100.0;
        assert!(steps.iter().all(|step| (step / mean - 1.0).abs() < 0.02), "{steps:?}");
        // No colour is cut off by what a screen can show.
        for i in 0..=200 {
            let [r, g, b] = Colours::Cyclic.at(f64::from(i) / 200.0);
            assert!([r, g, b].iter().all(|&c| c > 0 && c < 255), "{i}: {r} {g} {b}");
        }
    }
}
