//! Which kind of network a file is, by what it takes and answers.
//!
//! The names and shapes are those of the exports in use: U2-Net and IS-Net as rembg has them, BiRefNet's own export,
//! EfficientSAM's own export (one file, or encoder and decoder), and the encoder and decoder that the exporters of
//! Segment Anything write, also of MobileSAM.

use super::picture::{Fit, Layout, MEAN_COLOUR, PictureForm};

/// Mean and standard deviation of ImageNet's colours, 0 to 1.
const IMAGENET: ([f32; 3], [f32; 3]) = (MEAN_COLOUR, [0.229, 0.224, 0.225]);
/// As IS-Net was trained.
const CENTRED: ([f32; 3], [f32; 3]) = ([0.5; 3], [1.0; 3]);
/// As a network takes it that does the rest itself: 0 to 1.
const PLAIN: ([f32; 3], [f32; 3]) = ([0.0; 3], [1.0; 3]);
/// As an encoder takes it that does the rest itself: 0 to 255.
const BYTES: ([f32; 3], [f32; 3]) = ([0.0; 3], [1.0 / 255.0; 3]);

/// Sides that a file leaves open: U2-Net's, and that of all others.
const U2NET_SIDE: usize = 320;
const LARGE_SIDE: usize = 1024;
/// A fixed side is at least and at most so long.
const SIDES: std::ops::RangeInclusive<usize> = 16..=4096;
/// U2-Net answers its map and the six of its stages.
const U2NET_OUTPUTS: usize = 7;

/// The decoder's input for what the encoder answers.
pub(super) const EMBEDDINGS: &str = "image_embeddings";
const NEEDED: &str = "needed is a network that takes one picture with 3 channels (like U2-Net, IS-Net or BiRefNet), one that also takes `batched_point_coords` and `batched_point_labels` (EfficientSAM), or the encoder and the decoder of one like MobileSAM, each with a --model of its own";

/// What the numbers of an input are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Number {
    Float,
    Integer,
    Other,
}

/// An input as a file declares it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Input {
    pub(super) name: String,
    pub(super) number: Number,
    /// `None` for a side that is open.
    pub(super) sides: Vec<Option<usize>>,
}

/// What a file takes and answers.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Signature {
    pub(super) inputs: Vec<Input>,
    pub(super) outputs: Vec<String>,
    /// Whether the first answer is between 0 and 1.
    pub(super) ends_in_sigmoid: bool,
}

/// A kind of network.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Kind {
    /// It answers a picture with a map.
    Salient(PictureForm),
    /// It also takes points.
    Prompted(PictureForm),
    /// Its encoder takes the picture, its decoder what that answers, and points. The decoder is the file of this number.
    Pair { form: PictureForm, decoder: usize },
}

impl Kind {
    /// The kind that files of these signatures are, or the number of the file that fits none, and why.
    pub(super) fn of(files: &[Signature]) -> Result<Self, (usize, String)> {
        match files {
            [file] => Self::of_one(file).map_err(|why| (0, why)),
            [first, second] => {
                let decoder = usize::from(!first.is_decoder());
                if !second.is_decoder() && decoder == 1 {
                    let why = format!("neither file is a decoder: {}", second.unfit());
                    return Err((1, why));
                }
                let encoder = 1 - decoder;
                files[decoder]
                    .check_decoder()
                    .map_err(|why| (decoder, why))?;
                let form = files[encoder].encoder_form();
                let form = form.map_err(|why| (encoder, why))?;
                Ok(Self::Pair { form, decoder })
            }
            _ => Err((0, NEEDED.to_owned())),
        }
    }

    fn of_one(file: &Signature) -> Result<Self, String> {
        if file.is_decoder() {
            return Err("it is a decoder: give the encoder that belongs to it as well, with another --model".to_owned());
        }
        if file.outputs.iter().any(|name| name.contains("embedding")) {
            return Err("it is an encoder: give the decoder that belongs to it as well, with another --model".to_owned());
        }
        let names = ["batched_point_coords", "batched_point_labels"];
        let pictures: Vec<&Input> = file
            .inputs
            .iter()
            .filter(|input| !names.contains(&input.name.as_str()))
            .collect();
        match (pictures.as_slice(), file.inputs.len()) {
            ([picture], 1) => file.salient_form(picture).map(Self::Salient),
            ([picture], 3) => {
                let form = file.planes(picture, LARGE_SIDE, Fit::Stretched, PLAIN)?;
                Ok(Self::Prompted(form))
            }
            _ => Err(file.unfit()),
        }
    }
}

impl Signature {
    fn is_decoder(&self) -> bool {
        self.inputs.iter().any(|input| input.name == EMBEDDINGS)
    }

    /// A decoder has inputs for points, and none but those that are known.
    fn check_decoder(&self) -> Result<(), String> {
        let is_known = |input: &Input| DecoderInput::named(&input.name).is_some();
        let takes = |wanted| {
            let mut inputs = self.inputs.iter();
            inputs.any(|input| DecoderInput::named(&input.name) == Some(wanted))
        };
        let is_whole = takes(DecoderInput::Points) && takes(DecoderInput::Labels);
        if is_whole && self.inputs.iter().all(is_known) {
            Ok(())
        } else {
            Err(self.unfit())
        }
    }

    fn salient_form(&self, picture: &Input) -> Result<PictureForm, String> {
        let declared = picture.sides.iter().skip(2).flatten().max();
        let is_u2net = match declared {
            Some(&side) => side < LARGE_SIDE,
            None => self.outputs.len() == U2NET_OUTPUTS,
        };
        let side = if is_u2net { U2NET_SIDE } else { LARGE_SIDE };
        let colours = if !is_u2net && self.ends_in_sigmoid {
            CENTRED
        } else {
            IMAGENET
        };
        self.planes(picture, side, Fit::Stretched, colours)
    }

    fn encoder_form(&self) -> Result<PictureForm, String> {
        let [picture] = self.inputs.as_slice() else {
            return Err(self.unfit());
        };
        if picture.name == "batched_images" {
            return self.planes(picture, LARGE_SIDE, Fit::Stretched, PLAIN);
        }
        if picture.sides.len() == 4 {
            return self.planes(picture, LARGE_SIDE, Fit::Padded, IMAGENET);
        }
        match picture.sides.as_slice() {
            &[height, width, None | Some(3)] if picture.number == Number::Float => self.form(
                (width, height),
                LARGE_SIDE,
                Layout::Pixels,
                Fit::Padded,
                BYTES,
            ),
            _ => Err(self.unfit()),
        }
    }

    /// The form of a picture whose channels stand one after the other.
    fn planes(
        &self,
        picture: &Input,
        side: usize,
        fit: Fit,
        colours: ([f32; 3], [f32; 3]),
    ) -> Result<PictureForm, String> {
        match picture.sides.as_slice() {
            &[None | Some(1), None | Some(3), height, width] if picture.number == Number::Float => {
                self.form((width, height), side, Layout::Planes, fit, colours)
            }
            _ => Err(self.unfit()),
        }
    }

    fn form(
        &self,
        (width, height): (Option<usize>, Option<usize>),
        side: usize,
        layout: Layout,
        fit: Fit,
        (mean, deviation): ([f32; 3], [f32; 3]),
    ) -> Result<PictureForm, String> {
        let (width, height) = (width.unwrap_or(side), height.unwrap_or(side));
        if !SIDES.contains(&width) || !SIDES.contains(&height) {
            return Err(self.unfit());
        }
        Ok(PictureForm {
            width,
            height,
            layout,
            fit,
            mean,
            deviation,
        })
    }

    /// Why it is none of the kinds.
    fn unfit(&self) -> String {
        let side =
            |side: &Option<usize>| side.map_or_else(|| "?".to_owned(), |side| side.to_string());
        let input = |input: &Input| {
            let sides: Vec<String> = input.sides.iter().map(side).collect();
            format!("`{}` ({})", input.name, sides.join(" x "))
        };
        let inputs: Vec<String> = self.inputs.iter().take(8).map(input).collect();
        match inputs.as_slice() {
            [] => format!("it has no inputs; {NEEDED}"),
            [one] => format!("its input is {one}; {NEEDED}"),
            more => format!("its inputs are {}; {NEEDED}", more.join(", ")),
        }
    }
}

/// What a decoder, or a network in one file, takes besides a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DecoderInput {
    /// What the encoder answers.
    Embeddings,
    Points,
    Labels,
    /// An earlier mask, and whether there is one.
    EarlierMask,
    HasEarlierMask,
    /// Height and width of the picture.
    Size,
}

impl DecoderInput {
    pub(super) fn named(name: &str) -> Option<Self> {
        Some(match name {
            EMBEDDINGS => Self::Embeddings,
            "point_coords" | "batched_point_coords" => Self::Points,
            "point_labels" | "batched_point_labels" => Self::Labels,
            "mask_input" => Self::EarlierMask,
            "has_mask_input" => Self::HasEarlierMask,
            "orig_im_size" => Self::Size,
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn input(name: &str, sides: &[usize]) -> Input {
        let side = |&side: &usize| (side > 0).then_some(side);
        Input {
            name: name.to_owned(),
            number: Number::Float,
            sides: sides.iter().map(side).collect(),
        }
    }

    fn file(inputs: Vec<Input>, outputs: &[&str]) -> Signature {
        Signature {
            inputs,
            outputs: outputs.iter().map(|name| (*name).to_owned()).collect(),
            ends_in_sigmoid: false,
        }
    }

    fn salient(sides: &[usize], outputs: usize, ends_in_sigmoid: bool) -> PictureForm {
        let signature = Signature {
            ends_in_sigmoid,
            ..file(vec![input("x", sides)], &vec!["y"; outputs])
        };
        match Kind::of(&[signature]) {
            Ok(Kind::Salient(form)) => form,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn networks_of_one_picture_differ_in_size_and_colours() {
        let u2net = salient(&[1, 3, 320, 320], 7, true);
        assert_eq!((u2net.width, u2net.mean), (320, IMAGENET.0));
        let open = salient(&[0, 3, 0, 0], 7, true);
        assert_eq!((open.width, open.height, open.mean), (320, 320, IMAGENET.0));
        let isnet = salient(&[1, 3, 1024, 1024], 12, true);
        assert_eq!((isnet.width, isnet.deviation), (1024, CENTRED.1));
        let birefnet = salient(&[0, 3, 0, 0], 1, false);
        assert_eq!((birefnet.width, birefnet.mean), (1024, IMAGENET.0));
        assert_eq!(salient(&[1, 3, 512, 768], 1, false).width, 768);
    }

    fn decoder(prefix: &str) -> Signature {
        let points = input(&format!("{prefix}point_coords"), &[1, 0, 2]);
        let labels = input(&format!("{prefix}point_labels"), &[1, 0]);
        let embeddings = input("image_embeddings", &[1, 256, 64, 64]);
        file(vec![embeddings, points, labels], &["masks"])
    }

    #[test]
    fn networks_with_points_are_known_by_their_inputs() {
        let whole = file(
            vec![
                input("batched_images", &[0, 3, 0, 0]),
                input("batched_point_coords", &[1, 1, 0, 2]),
                input("batched_point_labels", &[1, 1, 0]),
            ],
            &["output_masks", "iou_predictions"],
        );
        assert!(matches!(Kind::of(&[whole]), Ok(Kind::Prompted(form)) if form.width == 1024));
        let encoder = file(
            vec![input("input_image", &[0, 0, 3])],
            &["image_embeddings"],
        );
        for files in [
            [encoder.clone(), decoder("")],
            [decoder("batched_"), encoder.clone()],
        ] {
            match Kind::of(&files) {
                Ok(Kind::Pair { form, decoder }) => {
                    assert!(files[decoder].is_decoder());
                    assert_eq!((form.layout, form.fit), (Layout::Pixels, Fit::Padded));
                }
                other => panic!("{other:?}"),
            }
        }
        assert!(Kind::of(std::slice::from_ref(&encoder)).is_err());
        assert!(Kind::of(&[decoder("")]).is_err());
        assert_eq!(Kind::of(&[encoder.clone(), encoder]).unwrap_err().0, 1);
    }

    #[test]
    fn what_fits_none_says_what_it_takes() {
        for inputs in [
            vec![],
            vec![input("tokens", &[1, 128])],
            vec![input("image", &[1, 4, 320, 320])],
            vec![input("image", &[8, 3, 320, 320])],
            vec![input("image", &[1, 3, 1, 1])],
            vec![input("image", &[1, 3, 0, 0]), input("scale", &[1])],
        ] {
            let (at, why) = Kind::of(&[file(inputs.clone(), &["y"])]).unwrap_err();
            assert_eq!(at, 0);
            let is_named = |input: &Input| why.contains(&input.name);
            assert!(inputs.iter().all(is_named), "{why}");
        }
        let mut tokens = input("image", &[1, 3, 320, 320]);
        tokens.number = Number::Integer;
        assert!(Kind::of(&[file(vec![tokens], &["y"])]).is_err());
    }
}
