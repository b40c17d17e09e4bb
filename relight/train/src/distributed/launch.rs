//! How a run over several processes is launched: the environment that torchrun, scripts of Slurm and the training
//! operators of Kubernetes set. Knows nothing of tensors.

use relight_core::reader::Rank;

use crate::error::TrainError;

/// The rank of this process in a run, and the address of its rendezvous.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Launch {
    /// Which process this is, and how many there are.
    pub rank: Rank,
    /// The process's number on its machine, if the launcher gives it: the number of its GPU.
    pub local: Option<usize>,
    /// The host name or address of process 0.
    pub address: String,
    /// The port at which the processes meet.
    pub port: u16,
    /// Whether the launcher listens at that port itself, as torchrun does; else process 0 does.
    pub hosted: bool,
    /// Which time the launcher starts the processes, from 0.
    pub attempt: u64,
}

impl Launch {
    /// Reads `RANK`, `WORLD_SIZE`, `MASTER_ADDR`, `MASTER_PORT` and `LOCAL_RANK`, and what torchrun adds. `None` for
    /// one process: without `RANK` and `WORLD_SIZE`, or with a `WORLD_SIZE` of 1. Empty variables count as missing.
    ///
    /// # Errors
    /// [`TrainError::Refused`].
    ///
    /// ```
    /// use relight_train::Launch;
    ///
    /// let variables = [("RANK", "1"), ("WORLD_SIZE", "2"), ("MASTER_ADDR", "node-0"), ("MASTER_PORT", "29500")];
    /// let variable = |name: &str| variables.iter().find(|v| v.0 == name).map(|v| v.1.to_owned());
    /// let launch = Launch::from_variables(variable)?.expect("there are two processes");
    /// assert_eq!((launch.rank.index(), launch.rank.world_size()), (1, 2));
    /// # Ok::<(), relight_train::TrainError>(())
    /// ```
    pub fn from_variables(
        variable: impl Fn(&str) -> Option<String>,
    ) -> Result<Option<Self>, TrainError> {
        let set = |name: &'static str| variable(name).filter(|value| !value.is_empty());
        let (rank, size) = match (set("RANK"), set("WORLD_SIZE")) {
            (None, None) => return Ok(None),
            (Some(_), None) => return Err(incomplete("RANK", "WORLD_SIZE")),
            (None, Some(_)) => return Err(incomplete("WORLD_SIZE", "RANK")),
            (Some(rank), Some(size)) => (rank, size),
        };
        let size = number("WORLD_SIZE", &size, "a number from 1", |size: &u32| {
            *size > 0
        })?;
        let allowed = format!("a number below WORLD_SIZE, which is {size}");
        let index = number("RANK", &rank, &allowed, |rank: &u32| *rank < size)?;
        let rank = match Rank::new(index, size) {
            Some(rank) if size > 1 => rank,
            _ => return Ok(None),
        };
        let needed = |name| set(name).ok_or_else(|| incomplete("WORLD_SIZE", name));
        let optional =
            |name| set(name).map(|value| number(name, &value, "a number", |_: &u64| true));
        Ok(Some(Self {
            rank,
            local: optional("LOCAL_RANK")
                .transpose()?
                .map(|local| local as usize),
            address: needed("MASTER_ADDR")?,
            port: number("MASTER_PORT", &needed("MASTER_PORT")?, "a port", |port| {
                *port > 0
            })?,
            hosted: set("TORCHELASTIC_USE_AGENT_STORE").as_deref() == Some("True"),
            attempt: optional("TORCHELASTIC_RESTART_COUNT")
                .transpose()?
                .unwrap_or(0),
        }))
    }
}

fn incomplete(set: &str, missing: &str) -> TrainError {
    TrainError::Refused(format!(
        "{set} is set and {missing} is not: set RANK, WORLD_SIZE, MASTER_ADDR and MASTER_PORT for each process, as torchrun \
         does, or unset RANK and WORLD_SIZE"
    ))
}

fn number<N: std::str::FromStr>(
    name: &str,
    value: &str,
    allowed: &str,
    is_right: impl Fn(&N) -> bool,
) -> Result<N, TrainError> {
    let number = value.parse().ok().filter(is_right);
    let fault = format!("the environment variable {name} is {value}: it has to be {allowed}");
    number.ok_or(TrainError::Refused(fault))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(variables: &[(&str, &str)]) -> Result<Option<Launch>, TrainError> {
        Launch::from_variables(|name| {
            let found = variables.iter().find(|(known, _)| *known == name);
            found.map(|(_, value)| (*value).to_owned())
        })
    }

    #[test]
    fn without_a_launcher_there_is_one_process() {
        assert_eq!(read(&[]).unwrap(), None);
        // As shells have it that export it for everything.
        assert_eq!(read(&[("MASTER_ADDR", "node-0")]).unwrap(), None);
        let one = [("RANK", "0"), ("WORLD_SIZE", "1")];
        assert_eq!(read(&one).unwrap(), None);
    }

    #[test]
    fn torchrun_listens_itself_and_counts_its_attempts() {
        let variables = [
            ("RANK", "3"),
            ("WORLD_SIZE", "4"),
            ("LOCAL_RANK", "1"),
            ("MASTER_ADDR", "node-0"),
            ("MASTER_PORT", "29500"),
            ("TORCHELASTIC_USE_AGENT_STORE", "True"),
            ("TORCHELASTIC_RESTART_COUNT", "2"),
        ];
        let expected = Launch {
            rank: Rank::new(3, 4).unwrap(),
            local: Some(1),
            address: "node-0".to_owned(),
            port: 29500,
            hosted: true,
            attempt: 2,
        };
        assert_eq!(read(&variables).unwrap(), Some(expected));
    }

    #[test]
    fn what_is_missing_or_wrong_is_named() {
        let two = [("RANK", "0"), ("WORLD_SIZE", "2")];
        let with = |more: &[(&'static str, &'static str)]| [&two, more].concat();
        for (variables, names) in [
            (vec![("RANK", "0")], ["RANK", "WORLD_SIZE"]),
            (vec![("WORLD_SIZE", "2")], ["WORLD_SIZE", "RANK"]),
            (with(&[]), ["WORLD_SIZE", "MASTER_ADDR"]),
            (with(&[("MASTER_ADDR", "a")]), ["WORLD_SIZE", "MASTER_PORT"]),
            (
                with(&[("MASTER_ADDR", "a"), ("MASTER_PORT", "no")]),
                ["MASTER_PORT", "no"],
            ),
            (vec![("RANK", "2"), ("WORLD_SIZE", "2")], ["RANK", "below"]),
            (
                vec![("RANK", "0"), ("WORLD_SIZE", "0")],
                ["WORLD_SIZE", "0"],
            ),
        ] {
            let error = read(&variables).unwrap_err().to_string();
            assert!(names.iter().all(|name| error.contains(name)), "{error}");
        }
    }
}
