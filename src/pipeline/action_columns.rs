//! Action units as columns of a motion table, by OpenFace's names.
//!
//! `AU12_r` is the intensity from 0 to 5, of an action with sides the stronger side's; `AU12_c` says whether it is there,
//! which is FACS's faintest degree, an intensity of 1. OpenFace trains its `_c` apart; here it follows from `_r`.
//! `AU12L_r` and `AU12R_r` keep the sides.

use crate::{
    actions::{ActionKey, ActionLibrary, Catalogue},
    lift::{Expression, Performer, Side},
    rig::{ActionSolver, RigError, SourceFace},
};

/// OpenFace's intensity of a full expression.
const FULL: f64 = 5.0;
/// From this intensity on an action counts as there.
const THERE: f64 = 1.0;

/// Measures the action units of a performer's expressions.
pub struct ActionColumns {
    solver: ActionSolver,
    units: Vec<(u8, bool)>,
}

impl ActionColumns {
    /// For one performer.
    pub fn new(library: &ActionLibrary, performer: &Performer) -> Result<Self, RigError> {
        let solver = ActionSolver::new(library, &SourceFace::performer(performer))?;
        let measured: Vec<u8> = solver.units();
        let units = Catalogue::get().actions.iter().filter(|action| measured.contains(&action.au));
        Ok(Self { units: units.map(|action| (action.au, action.sides)).collect(), solver })
    }

    /// The columns' names.
    pub fn names(&self) -> Vec<String> {
        let mut names = Vec::new();
        for &(au, sides) in &self.units {
            names.extend([format!("AU{au:02}_r"), format!("AU{au:02}_c")]);
            if sides {
                names.extend([format!("AU{au:02}L_r"), format!("AU{au:02}R_r")]);
            }
        }
        names
    }

    /// One row's cells, in the order of the names.
    pub fn fill(&self, expression: &Expression, cells: &mut Vec<f64>) {
        let weights = self.solver.measure(expression);
        cells.clear();
        for &(au, sides) in &self.units {
            let of = |side| FULL * weights.of(ActionKey { au, side });
            if sides {
                let (left, right) = (of(Some(Side::Left)), of(Some(Side::Right)));
                let stronger = left.max(right);
                cells.extend([stronger, there(stronger), left, right]);
            } else {
                cells.extend([of(None), there(of(None))]);
            }
        }
    }
}

fn there(intensity: f64) -> f64 {
    f64::from(u8::from(intensity >= THERE))
}
