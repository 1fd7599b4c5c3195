//! Settings that are put in force for a program, and given back afterwards.

use crate::link::LinkError;

use super::Session;

/// Settings in force for the program.
#[derive(Clone, Debug, Default)]
pub struct Borrowed {
    /// Name and value before.
    before: Vec<(&'static str, String)>,
}

impl Borrowed {
    /// Puts a setting in force; whether the controller has it. A controller of another make
    /// refuses it, and goes on as it is.
    ///
    /// # Errors
    /// The link is lost.
    pub fn set(
        &mut self,
        session: &mut Session,
        name: &'static str,
        value: f64,
    ) -> Result<bool, LinkError> {
        let found = session.ask(&format!("${name}"))?;
        let before = found.settings.into_iter().next().map(|(_, value)| value);
        if before.as_ref().and_then(|text| text.parse().ok()) == Some(value) {
            return Ok(true);
        }
        if session.ask(&format!("${name}={value}"))?.error.is_some() {
            return Ok(false);
        }
        self.before.extend(before.map(|before| (name, before)));
        Ok(true)
    }

    /// Gives them all back. The controller has to be at rest.
    ///
    /// # Errors
    /// The link is lost.
    pub fn give_back(&mut self, session: &mut Session) -> Result<(), LinkError> {
        for (name, value) in self.before.drain(..) {
            session.ask(&format!("${name}={value}"))?;
        }
        Ok(())
    }
}
