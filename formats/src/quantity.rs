//! The quantities that files state of their fields, in words: of columns of FITS tables by keywords, of variables by
//! attributes.
//!
//! Which quantities there are, and what follows from one, is left to the caller.

use crate::card::{Card, CardValue};
use crate::dataset::{Attribute, Variable};

/// The quantity that a file states of a field: `TQTYn` and `TSYMn` of a FITS column, the attributes `quantity` and
/// `symmetry` of a variable.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct StatedQuantity {
    /// The quantity's name, such as `angle`.
    pub quantity: String,
    /// The symmetry of an angle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub symmetry: Option<u32>,
}

impl StatedQuantity {
    /// The header entries that state the quantity of a FITS column, which is numbered from 1.
    pub fn cards(&self, column: usize) -> Vec<Card> {
        self.stated([format!("TQTY{column}"), format!("TSYM{column}")])
    }

    /// The attributes that state the quantity of a variable.
    pub(crate) fn attributes(&self) -> Vec<Card> {
        self.stated(["quantity", "symmetry"].map(str::to_owned))
    }

    fn stated(&self, [quantity, symmetry]: [String; 2]) -> Vec<Card> {
        let card = |key, value, comment: &str| Card { key, value, comment: comment.to_owned() };
        let name = card(quantity, CardValue::Text(self.quantity.clone()), "kind of quantity");
        let turns = |n: u32| card(symmetry, CardValue::Integer(n.into()), "turns within 360 deg that change nothing");
        std::iter::once(name).chain(self.symmetry.map(turns)).collect()
    }

    /// The quantity that a variable states, if any.
    pub(crate) fn of(variable: &Variable) -> Option<Self> {
        let quantity = variable.text("quantity").map(str::trim).filter(|text| !text.is_empty())?.to_owned();
        let symmetry = match variable.attribute("symmetry") {
            Some(Attribute::Whole(numbers)) => match numbers[..] {
                [number] => u32::try_from(number).ok(),
                _ => None,
            },
            _ => None,
        };
        Some(StatedQuantity { quantity, symmetry })
    }
}
