//! A model in ONNX as tract runs it.

use super::describe::OnnxDescription;
use super::input::{Reader, about};
use crate::config::FitConfig;
use crate::dataset::Dataset;
use crate::geometry::{Vec3, add, scale};
use crate::input::read_bytes;
use crate::network::model::MOST_BYTES;
use crate::network::{JointModel, ModelError, ModelInput, ParamsOf};
use crate::task::panic_as_error;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use tract_onnx::Onnx;
use tract_onnx::pb::{GraphProto, ModelProto};
use tract_onnx::prelude::*;
use tract_onnx::tract_hir::infer::{DimFact, Factoid as _};

/// A tensor that a model answers: its shape, and its numbers in C order.
type Answered = (Vec<usize>, Vec<f32>);

/// A model in ONNX, its tensors described, made ready for a data set.
pub struct OnnxModel {
    described: OnnxDescription,
    joints: Vec<String>,
    config: FitConfig,
    readers: Vec<Reader>,
    /// The description of each of the model's inputs, in the model's order.
    order: Vec<usize>,
    shapes: Vec<Vec<usize>>,
    /// Which output the joints are, and which their scores.
    outputs: (usize, Option<usize>),
    plan: Arc<TypedSimplePlan>,
    /// Its name, its opset and its weights, in words.
    summary: String,
}

impl OnnxModel {
    /// Opens a model for a data set; its description is the file beside it, or another.
    ///
    /// # Errors
    /// Where one of them cannot be read, the model has operators that are not known, or it does not fit the data.
    pub fn open(
        path: &Path,
        description: Option<&Path>,
        dataset: &Dataset,
        config: &FitConfig,
    ) -> Result<Self, ModelError> {
        let failed = |message: String| ModelError::Onnx { message, path: path.to_owned() };
        let bytes = read_bytes(path, "a model in ONNX", MOST_BYTES)
            .map_err(|reason| ModelError::Read { reason, path: path.to_owned() })?;
        let onnx = tract_onnx::onnx();
        // A damaged file is another program's: what it does to a reader of files must not end this one.
        let (proto, mut model) = panic_as_error(|| parsed(&onnx, &bytes)).map_err(failed)?;
        let beside = OnnxDescription::beside(path);
        let described = match description {
            Some(description) => OnnxDescription::from_file(description)?,
            None if beside.is_file() => OnnxDescription::from_file(&beside)?,
            None => return Err(ModelError::NotDescribed { has: tensors(&model), beside, path: path.to_owned() }),
        };
        let misfit = |message: String| ModelError::Misfit { message, path: path.to_owned() };
        let order = order(&model, &described).map_err(misfit)?;
        let outputs = outputs(&model, &described).map_err(misfit)?;
        let mut readers = Vec::with_capacity(described.input.len());
        for input in &described.input {
            readers.push(Reader::new(input, dataset).map_err(misfit)?);
        }
        let mut shapes = Vec::with_capacity(order.len());
        for (k, &told) in order.iter().enumerate() {
            shapes.push(shape(&model, k, described.input[told].shape.as_deref(), &readers[told]).map_err(misfit)?);
        }
        let plan = panic_as_error(|| {
            for (k, shape) in shapes.iter().enumerate() {
                let dtype = model.input_fact(k).map_err(said)?.datum_type.concretize().unwrap_or(f32::datum_type());
                model.set_input_fact(k, InferenceFact::dt_shape(dtype, shape.as_slice())).map_err(said)?;
            }
            let output = model.output_outlets().map_err(said)?.to_vec();
            // What an exporter wrote of its outputs' sizes holds for its own example.
            for k in 0..output.len() {
                model.set_output_fact(k, InferenceFact::default()).map_err(said)?;
            }
            model.into_optimized().and_then(IntoRunnable::into_runnable).map_err(said)
        })
        .map_err(|why| failed(format!("cannot be made ready to run: {why}")))?;
        let summary = summary(path, &proto);
        let (joints, config) = (described.joints(), *config);
        Ok(Self { described, joints, config, readers, order, shapes, outputs, plan, summary })
    }

    /// The joints that it answers, and the scores where there are some.
    fn run(&self, tensors: &[Vec<f32>]) -> Result<(Answered, Option<Answered>), String> {
        let mut inputs = TVec::new();
        for (k, (&told, shape)) in self.order.iter().zip(&self.shapes).enumerate() {
            let numbers = tensors.get(told).ok_or("a tensor is missing")?;
            let tensor = Tensor::from_shape(shape, numbers).map_err(said)?;
            let dtype = self.plan.model().input_fact(k).map_err(said)?.datum_type;
            inputs.push(tensor.cast_to_dt(dtype).map_err(said)?.into_owned().into_tvalue());
        }
        let answered = panic_as_error(|| self.plan.run(inputs).map_err(said))?;
        let read = |k: usize| -> Result<Answered, String> {
            let tensor = answered.get(k).ok_or("an output is missing")?;
            let numbers = tensor.cast_to::<f32>().map_err(said)?;
            let numbers = numbers.to_plain_array_view::<f32>().map_err(said)?.iter().copied().collect();
            Ok((tensor.shape().to_vec(), numbers))
        };
        let (joints, scores) = self.outputs;
        Ok((read(joints)?, scores.map(read).transpose()?))
    }
}

impl JointModel for OnnxModel {
    fn joints(&self) -> &[String] {
        &self.joints
    }

    fn needs_fit(&self) -> bool {
        self.described.needs_fit()
    }

    fn reach(&self) -> usize {
        let steps = self.described.input.iter().flat_map(|input| &input.frames);
        steps.map(|step| step.unsigned_abs()).max().unwrap_or(0)
    }

    fn read(&self, dataset: &Dataset, index: usize, params: &ParamsOf) -> Result<Vec<ModelInput>, String> {
        let own = params.get(&index);
        if self.needs_fit() && own.is_none() {
            return Err("has no fit".into());
        }
        let persons = own.filter(|_| self.described.of_person()).map_or(1, |own| own.shape().persons);
        let of_person = |person: usize| {
            let point =
                own.map_or([0.0; 3], |own| about(self.described.output.about, own, person, &dataset.info().skeleton));
            let read = |reader: &Reader| reader.read((dataset, &self.config), index, params, person);
            Ok(ModelInput { tensors: self.readers.iter().map(read).collect::<Result<_, String>>()?, about: point })
        };
        (0..persons).map(of_person).collect()
    }

    fn answer(&self, input: &ModelInput) -> Result<Vec<Vec<Vec3>>, String> {
        let ((shape, numbers), scores) = self.run(&input.tensors)?;
        let (told, width) = (&self.described.output, 3 * self.joints.len());
        let rows: Vec<&[f32]> = numbers.chunks_exact(width).collect();
        if rows.is_empty() || numbers.len() != rows.len() * width {
            return Err(format!("it answers {shape:?}; expected a multiple of {} x 3", self.joints.len()));
        }
        let rows = match told.take {
            None => rows,
            Some(take) => {
                let n = rows.len();
                vec![*rows.get(take).ok_or_else(|| format!("take = {take}; it answers {n} rows"))?]
            }
        };
        let scores = scores.map(|(_, scores)| scores);
        if let Some(scores) = scores.as_ref().filter(|scores| scores.len() != rows.len()) {
            return Err(format!("it answers {} scores for {} persons", scores.len(), rows.len()));
        }
        let there = |k: &usize| scores.as_ref().is_none_or(|scores| f64::from(scores[*k]) >= told.least_score);
        let mut persons = Vec::new();
        for row in (0..rows.len()).filter(there).map(|k| rows[k]) {
            if row.iter().any(|x| !x.is_finite()) {
                return Err("it answers what is no finite number".into());
            }
            let point = |p: &[f32; 3]| add(told.axes.world(scale(p.map(f64::from), told.unit.metres())), input.about);
            persons.push(row.as_chunks::<3>().0.iter().map(point).collect());
        }
        Ok(persons)
    }

    fn summary(&self) -> String {
        self.summary.clone()
    }
}

/// An error of tract with what led to it, in a line.
#[expect(clippy::needless_pass_by_value, reason = "for `map_err`")]
fn said(error: TractError) -> String {
    let chain: Vec<String> = error.chain().map(|cause| cause.to_string().replace('\n', " ")).collect();
    let text = chain.join(": ");
    text.chars().take(MOST_SAID).collect()
}

/// Letters of an error that are shown.
const MOST_SAID: usize = 400;

fn parsed(onnx: &Onnx, bytes: &[u8]) -> Result<(ModelProto, InferenceModel), String> {
    let proto =
        onnx.proto_model_for_read(&mut &*bytes).map_err(|error| format!("no model in ONNX: {}", said(error)))?;
    let graph = proto.graph.as_ref().ok_or("no model in ONNX: it has no graph")?;
    let mut unknown = BTreeSet::new();
    unknown_operators(onnx, graph, &mut unknown);
    if !unknown.is_empty() {
        let names: Vec<String> = unknown.iter().map(|name| format!("`{}`", name.escape_debug())).collect();
        return Err(format!(
            "it has operators that are not known here: {} (opset {}); export it without them",
            names.join(", "),
            opset(&proto)
        ));
    }
    let outside = graph.initializer.iter().find(|tensor| !tensor.external_data.is_empty());
    if let Some(tensor) = outside {
        let name = tensor.name.escape_debug();
        return Err(format!("its tensor `{name}` lies in another file; expected one file (under 2 GB)"));
    }
    let read =
        onnx.parse(&proto, None).map_err(|error| format!("no model in ONNX that can be read: {}", said(error)))?;
    if let Some(missing) = read.unresolved_inputs.first() {
        return Err(format!("no model in ONNX: nothing gives `{}`", missing.escape_debug()));
    }
    Ok((proto, read.model))
}

/// Operators of a graph and of those inside it that tract does not know.
fn unknown_operators(onnx: &Onnx, graph: &GraphProto, unknown: &mut BTreeSet<String>) {
    for node in &graph.node {
        if !onnx.op_register.0.contains_key(&node.op_type) {
            unknown.insert(node.op_type.clone());
        }
        for inside in node.attribute.iter().filter_map(|attribute| attribute.g.as_ref()) {
            unknown_operators(onnx, inside, unknown);
        }
    }
}

fn opset(proto: &ModelProto) -> i64 {
    let own = proto.opset_import.iter().find(|of| of.domain.is_empty() || of.domain == "ai.onnx");
    own.map_or(0, |of| of.version)
}

fn summary(path: &Path, proto: &ModelProto) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let numbers = |dims: &[i64]| dims.iter().map(|&dim| dim.max(0) as f64).product::<f64>();
    let weights: f64 =
        proto.graph.iter().flat_map(|graph| &graph.initializer).map(|tensor| numbers(&tensor.dims)).sum();
    format!("{name} in ONNX (opset {}), {weights} parameters, {:.1} MB", opset(proto), 4e-6 * weights)
}

/// The names of the model's inputs, in its order.
fn input_names(model: &InferenceModel) -> Vec<String> {
    let outlets = model.input_outlets().unwrap_or_default();
    outlets.iter().map(|outlet| model.node(outlet.node).name.clone()).collect()
}

fn output_names(model: &InferenceModel) -> Vec<String> {
    let outlets = model.output_outlets().unwrap_or_default();
    let name = |outlet: &OutletId| {
        model.outlet_label(*outlet).map_or_else(|| model.node(outlet.node).name.clone(), ToOwned::to_owned)
    };
    outlets.iter().map(name).collect()
}

/// What a model reads and gives, in words.
fn tensors(model: &InferenceModel) -> String {
    let of = |(k, name): (usize, &String)| {
        let shape = model.input_fact(k).map_or_else(|_| "?".into(), |fact| format!("{:?}", fact.shape));
        format!("`{}` ({shape})", name.escape_debug())
    };
    let inputs: Vec<String> = input_names(model).iter().enumerate().map(of).collect();
    let outputs: Vec<String> = output_names(model).iter().map(|name| format!("`{}`", name.escape_debug())).collect();
    format!("It reads {} and gives {}", inputs.join(", "), outputs.join(", "))
}

/// The description of each of the model's inputs.
fn order(model: &InferenceModel, described: &OnnxDescription) -> Result<Vec<usize>, String> {
    let names = input_names(model);
    if described.input.len() != names.len() {
        return Err(format!("{} [[input]] are described. {}", described.input.len(), tensors(model)));
    }
    let of = |name: &String| {
        let told = described.input.iter().position(|input| input.tensor.as_ref() == Some(name));
        let only = (names.len() == 1 && described.input[0].tensor.is_none()).then_some(0);
        told.or(only)
            .ok_or_else(|| format!("no [[input]] has tensor = \"{}\". {}", name.escape_debug(), tensors(model)))
    };
    names.iter().map(of).collect()
}

/// Which outputs are the joints and the scores.
fn outputs(model: &InferenceModel, described: &OnnxDescription) -> Result<(usize, Option<usize>), String> {
    let names = output_names(model);
    let find = |wanted: &String| {
        let at = names.iter().position(|name| name == wanted);
        at.ok_or_else(|| format!("it gives no `{}`. {}", wanted.escape_debug(), tensors(model)))
    };
    let told = &described.output;
    let joints = match &told.tensor {
        Some(name) => find(name)?,
        None if names.len() == 1 => 0,
        None => return Err(format!("[output] has no tensor = ..., and the model gives several. {}", tensors(model))),
    };
    Ok((joints, told.scores.as_ref().map(find).transpose()?))
}

/// The shape of an input: as told, else as the model has it, where an open first axis is a batch of one and one more open axis is what
/// the numbers leave for it.
fn shape(model: &InferenceModel, k: usize, told: Option<&[usize]>, reader: &Reader) -> Result<Vec<usize>, String> {
    let name = input_names(model).get(k).cloned().unwrap_or_default();
    let name = name.escape_debug();
    let fact = model.input_fact(k).map_err(said)?;
    let of = |dim: &DimFact| dim.concretize().and_then(|dim| usize::try_from(dim.to_i64().ok()?).ok());
    let known: Option<Vec<Option<usize>>> = (!fact.shape.is_open()).then(|| fact.shape.dims().map(of).collect());
    let shape = match (told, known) {
        (Some(told), known) => {
            let fits = |(told, of): (&usize, &Option<usize>)| of.is_none_or(|of| of == *told);
            if let Some(known) = known.filter(|known| known.len() != told.len() || !told.iter().zip(known).all(fits)) {
                return Err(format!("shape of `{name}` = {told:?}; the model's is {}", shown(&known)));
            }
            told.to_vec()
        }
        (None, None) => {
            return Err(format!(
                "the model does not say the shape of `{name}`; expected shape = [...] in its [[input]]"
            ));
        }
        (None, Some(mut known)) => {
            if let Some(first) = known.first_mut().filter(|first| first.is_none()) {
                *first = Some(1);
            }
            let product = cells(known.iter().flatten()).unwrap_or(0);
            let open: Vec<usize> = (0..known.len()).filter(|&axis| known[axis].is_none()).collect();
            match open[..] {
                [] => {}
                [axis] if product > 0 && reader.numbers.is_multiple_of(product) => {
                    known[axis] = Some(reader.numbers / product);
                }
                _ => {
                    return Err(format!(
                        "the model's shape of `{name}` is {}; expected shape = [...] in its [[input]]",
                        shown(&known)
                    ));
                }
            }
            known.into_iter().flatten().collect()
        }
    };
    if cells(&shape) != Some(reader.numbers) {
        return Err(format!("`{name}` is {shape:?}; the data give {} numbers ({})", reader.numbers, reader.form));
    }
    Ok(shape)
}

/// Numbers of a tensor; `None` where there are more than can be counted.
fn cells<'a>(shape: impl IntoIterator<Item = &'a usize>) -> Option<usize> {
    shape.into_iter().try_fold(1usize, |product, dim| product.checked_mul(*dim))
}

fn shown(shape: &[Option<usize>]) -> String {
    let dims: Vec<String> = shape.iter().map(|dim| dim.map_or("?".into(), |dim| dim.to_string())).collect();
    format!("[{}]", dims.join(", "))
}
