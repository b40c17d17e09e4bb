//! ONNX files of small networks that find what is bright, with the inputs and outputs of the networks in use.

use prost::Message;
use tract_onnx::pb::attribute_proto::AttributeType;
use tract_onnx::pb::tensor_proto::{DataLocation, DataType};
use tract_onnx::pb::tensor_shape_proto::{Dimension, dimension};
use tract_onnx::pb::type_proto::{Tensor, Value};
use tract_onnx::pb::{
    AttributeProto, GraphProto, ModelProto, NodeProto, OperatorSetIdProto, StringStringEntryProto,
    TensorProto, TensorShapeProto, TypeProto, ValueInfoProto,
};

/// A network that is being written.
#[derive(Default)]
pub(crate) struct Writer(GraphProto);

impl Writer {
    /// An input; a side of 0 is open.
    pub(crate) fn input(&mut self, name: &str, sides: &[i64]) {
        self.0.input.push(value(name, sides));
    }

    pub(crate) fn output(&mut self, name: &str) {
        self.0.output.push(value(name, &[]));
    }

    pub(crate) fn constant(&mut self, name: &str, sides: &[i64], values: &[f32]) {
        self.0.initializer.push(TensorProto {
            name: name.to_owned(),
            dims: sides.to_vec(),
            data_type: DataType::Float as i32,
            raw_data: values
                .iter()
                .flat_map(|value| value.to_le_bytes())
                .collect(),
            ..TensorProto::default()
        });
    }

    /// A constant whose values are the content of another file.
    pub(crate) fn weights_in(&mut self, name: &str, sides: &[i64], location: &str) {
        let location = StringStringEntryProto {
            key: "location".to_owned(),
            value: location.to_owned(),
        };
        self.0.initializer.push(TensorProto {
            name: name.to_owned(),
            dims: sides.to_vec(),
            data_type: DataType::Float as i32,
            external_data: vec![location],
            data_location: Some(DataLocation::External as i32),
            ..TensorProto::default()
        });
    }

    /// An operation, whose attributes are integers.
    pub(crate) fn node(
        &mut self,
        operation: &str,
        inputs: &[&str],
        output: &str,
        attributes: &[(&str, &[i64])],
    ) {
        let attribute = |&(name, values): &(&str, &[i64])| AttributeProto {
            name: name.to_owned(),
            r#type: match values {
                [_] if name != "axes" => AttributeType::Int,
                _ => AttributeType::Ints,
            } as i32,
            i: values[0],
            ints: values.to_vec(),
            ..AttributeProto::default()
        };
        self.0.node.push(NodeProto {
            op_type: operation.to_owned(),
            name: format!("{operation}.{output}"),
            input: inputs.iter().map(|name| (*name).to_owned()).collect(),
            output: vec![output.to_owned()],
            attribute: attributes.iter().map(attribute).collect(),
            ..NodeProto::default()
        });
    }

    pub(crate) fn bytes(self) -> Vec<u8> {
        let model = ModelProto {
            ir_version: 7,
            graph: Some(self.0),
            opset_import: vec![OperatorSetIdProto {
                version: 12,
                ..OperatorSetIdProto::default()
            }],
            ..ModelProto::default()
        };
        model.encode_to_vec()
    }

    /// `output` = the mean over an axis of `input`, less `threshold`, times `gain`.
    pub(crate) fn bright(
        &mut self,
        input: &str,
        axis: i64,
        (threshold, gain): (f32, f32),
        output: &str,
    ) {
        self.constant("threshold", &[], &[threshold]);
        self.constant("gain", &[], &[gain]);
        let axes: &[(&str, &[i64])] = &[("axes", &[axis]), ("keepdims", &[1])];
        self.node("ReduceMean", &[input], "grey", axes);
        self.node("Sub", &["grey", "threshold"], "above", &[]);
        self.node("Mul", &["above", "gain"], output, &[]);
    }

    /// `output` = 1000 times how far the input is from what is expected.
    fn distance(&mut self, input: &str, expected: &[f32], output: &str) {
        let [flat, wanted, off, apart, sum, weight] =
            ["flat", "wanted", "off", "apart", "sum", "weight"]
                .map(|part| format!("{output}.{part}"));
        self.constant(&wanted, &[expected.len() as i64], expected);
        self.constant(&weight, &[], &[1000.0]);
        self.node("Flatten", &[input], &flat, &[("axis", &[0])]);
        self.node("Sub", &[&flat, &wanted], &off, &[]);
        self.node("Abs", &[&off], &apart, &[]);
        let axes: &[(&str, &[i64])] = &[("axes", &[0, 1]), ("keepdims", &[0])];
        self.node("ReduceSum", &[&apart], &sum, axes);
        self.node("Mul", &[&sum, &weight], output, &[]);
    }

    /// Takes from `input` what the prompt is off from the expected points and labels.
    fn only_for(
        &mut self,
        input: &str,
        prefix: &str,
        (points, labels): (&[f32], &[f32]),
        output: &str,
    ) {
        self.distance(&format!("{prefix}point_coords"), points, "points_off");
        self.distance(&format!("{prefix}point_labels"), labels, "labels_off");
        self.node("Sub", &[input, "points_off"], "for_points", &[]);
        self.node("Sub", &["for_points", "labels_off"], output, &[]);
    }
}

fn value(name: &str, sides: &[i64]) -> ValueInfoProto {
    let side = |&side: &i64| Dimension {
        value: Some(match side {
            0 => dimension::Value::DimParam("open".to_owned()),
            side => dimension::Value::DimValue(side),
        }),
        ..Dimension::default()
    };
    let shape = (!sides.is_empty()).then(|| TensorShapeProto {
        dim: sides.iter().map(side).collect(),
    });
    ValueInfoProto {
        name: name.to_owned(),
        r#type: Some(TypeProto {
            value: Some(Value::TensorType(Tensor {
                elem_type: DataType::Float as i32,
                shape,
            })),
            ..TypeProto::default()
        }),
        ..ValueInfoProto::default()
    }
}

/// As U2-Netp is exported: a picture of 320 x 320, and seven maps between 0 and 1, of which the first counts.
pub(crate) fn u2netp() -> Vec<u8> {
    let mut writer = Writer::default();
    writer.input("input.1", &[1, 3, 320, 320]);
    writer.bright("input.1", 1, (0.0, 9.0), "logits");
    writer.constant("none", &[], &[0.0]);
    for (at, name) in ["1959", "1960", "1961", "1962", "1963", "1964", "1965"]
        .iter()
        .enumerate()
    {
        writer.output(name);
        if at == 0 {
            writer.node("Sigmoid", &["logits"], name, &[]);
        } else {
            writer.node("Mul", &["logits", "none"], name, &[]);
        }
    }
    writer.bytes()
}

/// As BiRefNet is exported: a picture of any size, and one map of logits.
pub(crate) fn birefnet() -> Vec<u8> {
    let mut writer = Writer::default();
    writer.input("input_image", &[0, 3, 0, 0]);
    writer.output("output_image");
    writer.bright("input_image", 1, (0.0, 9.0), "output_image");
    writer.bytes()
}

/// As EfficientSAM is exported in one file: three masks and their scores. They are right only for this prompt.
pub(crate) fn efficient_sam(points: &[f32], labels: &[f32]) -> Vec<u8> {
    let mut writer = Writer::default();
    writer.input("batched_images", &[0, 3, 0, 0]);
    writer.input("batched_point_coords", &[1, 1, 0, 2]);
    writer.input("batched_point_labels", &[1, 1, 0]);
    writer.bright("batched_images", 1, (0.45, 40.0), "logits");
    writer.only_for("logits", "batched_", (points, labels), "right");
    writer.node("Neg", &["right"], "wrong", &[]);
    writer.node(
        "Concat",
        &["wrong", "right", "wrong"],
        "masks",
        &[("axis", &[1])],
    );
    let axes: &[(&str, &[i64])] = &[("axes", &[1])];
    writer.node("Unsqueeze", &["masks"], "output_masks", axes);
    writer.constant("iou_predictions", &[1, 1, 3], &[0.2, 0.9, 0.5]);
    writer.output("output_masks");
    writer.output("iou_predictions");
    writer.bytes()
}

/// As the encoder of MobileSAM is exported, which takes bytes.
pub(crate) fn encoder() -> Vec<u8> {
    let mut writer = Writer::default();
    writer.input("input_image", &[0, 0, 3]);
    writer.bright("input_image", 2, (115.0, 0.2), "bright");
    let axes: &[(&str, &[i64])] = &[("axes", &[0])];
    writer.node("Transpose", &["bright"], "turned", &[("perm", &[2, 0, 1])]);
    writer.node("Unsqueeze", &["turned"], "plane", axes);
    let pooled: &[(&str, &[i64])] = &[("kernel_shape", &[16, 16]), ("strides", &[16, 16])];
    writer.node("AveragePool", &["plane"], "image_embeddings", pooled);
    writer.output("image_embeddings");
    writer.bytes()
}

/// As the decoder of MobileSAM is exported. Its masks are right only for this prompt.
pub(crate) fn decoder(points: &[f32], labels: &[f32]) -> Vec<u8> {
    let mut writer = Writer::default();
    writer.input("image_embeddings", &[1, 1, 64, 64]);
    writer.input("point_coords", &[1, 0, 2]);
    writer.input("point_labels", &[1, 0]);
    writer.input("mask_input", &[1, 1, 256, 256]);
    writer.input("has_mask_input", &[1]);
    writer.input("orig_im_size", &[2]);
    writer.only_for("image_embeddings", "", (points, labels), "right");
    writer.node("Mul", &["right", "has_mask_input"], "masks", &[]);
    writer.node("Neg", &["right"], "wrong", &[]);
    writer.node(
        "Concat",
        &["right", "wrong", "wrong", "wrong"],
        "low_res_masks",
        &[("axis", &[1])],
    );
    writer.constant("iou_predictions", &[1, 4], &[0.2, 0.9, 0.5, 0.1]);
    for name in ["masks", "iou_predictions", "low_res_masks"] {
        writer.output(name);
    }
    writer.bytes()
}
