//! Networks by ONNX Runtime: its library is loaded when it is asked for, and nothing of it is needed to build.

use std::path::{self, Path};
use std::sync::Mutex;

use ort::LoadDynamicError;
use ort::environment::Environment;
use ort::session::builder::GraphOptimizationLevel;
use ort::session::{Session, SessionInputValue};
use ort::value::{Tensor as OrtTensor, TensorRef};
use relit_data::causes::with_causes;

use super::engine::Plan;
use super::error::NetError;
use super::weights::Tensor;

/// The library of ONNX Runtime, 1.17 or later, loaded.
#[derive(Clone)]
pub struct OnnxRuntime {
    environment: Environment,
}

impl std::fmt::Debug for OnnxRuntime {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("OnnxRuntime").finish_non_exhaustive()
    }
}

impl OnnxRuntime {
    /// The library's name where the system knows it.
    #[must_use]
    pub fn library() -> String {
        let (prefix, suffix) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
        format!("{prefix}onnxruntime{suffix}")
    }

    /// Loads the library: a path, or a name that the system finds. A program has one of them: where one is loaded
    /// already, it stays.
    ///
    /// # Errors
    /// [`NetError::NoLibrary`] where there is none; [`NetError::File`] where it cannot be used.
    pub fn load(library: &Path) -> Result<Self, NetError> {
        let is_name = library.components().count() < 2 && !library.exists();
        let path = if is_name {
            Ok(library.to_owned())
        } else {
            path::absolute(library)
        };
        let unusable = |fault: &dyn std::fmt::Display| NetError::File {
            path: library.to_owned(),
            fault: format!(
                "{fault}; set ORT_DYLIB_PATH to the library of ONNX Runtime 1.17 or later, or use --engine tract"
            ),
        };
        let path = path.map_err(|fault| unusable(&fault))?;
        let environment = ort::init_from(&path).map_err(|fault| match fault {
            LoadDynamicError::Dlopen { .. } if !path.exists() => NetError::NoLibrary {
                path: library.to_owned(),
            },
            LoadDynamicError::Dlopen { error, .. } => unusable(&with_causes(&error)),
            fault => unusable(&fault),
        })?;
        let environment = environment.with_name("relight").with_telemetry(false);
        let environment = environment.build().map_err(|fault| unusable(&fault))?;
        Ok(Self { environment })
    }

    pub(super) fn prepare(
        &self,
        onnx: &[u8],
        shape: [usize; 4],
        given: &[(String, i64)],
    ) -> Result<impl Plan + use<>, String> {
        let session = Session::builder(&self.environment)
            .and_then(
                |builder| Ok(builder.with_optimization_level(GraphOptimizationLevel::Level3)?),
            )
            .and_then(|mut builder| builder.commit_from_memory(onnx))
            .map_err(|fault| fault.to_string())?;
        let inputs = session.inputs().iter();
        let inputs = inputs.map(|input| {
            let name = input.name().to_owned();
            let number = given.iter().find(|(given, _)| *given == name);
            (name, number.map(|(_, number)| *number))
        });
        Ok(SessionPlan {
            inputs: inputs.collect(),
            session: Mutex::new(session),
            shape,
        })
    }
}

/// A network in ONNX Runtime. One input at a time: the library itself shares its work among the cores.
struct SessionPlan {
    /// Names of its inputs, and the number that goes into each; none for the picture.
    inputs: Vec<(String, Option<i64>)>,
    session: Mutex<Session>,
    shape: [usize; 4],
}

impl Plan for SessionPlan {
    fn run(&self, input: &[f32]) -> Result<Vec<Tensor>, String> {
        let mut session = self.session.lock();
        // A session is not left half changed by a panic elsewhere.
        let session = match &mut session {
            Ok(session) => session,
            Err(poisoned) => poisoned.get_mut(),
        };
        let failed = |fault: ort::Error| fault.to_string();
        let mut values: Vec<(&str, SessionInputValue<'_>)> = Vec::new();
        for (name, number) in &self.inputs {
            let value = match number {
                Some(number) => {
                    let number = OrtTensor::from_array((Vec::<i64>::new(), vec![*number]));
                    number.map_err(failed)?.into()
                }
                None => {
                    let picture = TensorRef::from_array_view((self.shape, input));
                    picture.map_err(failed)?.into()
                }
            };
            values.push((name, value));
        }
        let outputs = session.run(values).map_err(failed)?;
        outputs
            .values()
            .map(|output| {
                let tensor = output.try_extract_tensor::<f32>();
                let (shape, values) = tensor.map_err(|fault| fault.to_string())?;
                let shape = shape.iter().map(|&side| side as usize).collect();
                let tensor = Tensor::new(shape, values.to_vec());
                tensor.ok_or_else(|| "an output has no shape".to_owned())
            })
            .collect()
    }
}
