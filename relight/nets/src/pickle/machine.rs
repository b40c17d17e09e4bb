//! The stack machine of pickle, protocols 2 to 4, as far as state dicts need it.
//!
//! Objects lie in one list and refer to each other by number, so that a pickle cannot make more of
//! them than it has instructions.

use std::collections::HashMap;

/// Most objects.
const MOST_OBJECTS: usize = 2_000_000;

/// The number of an object.
pub(super) type Id = usize;

/// Kinds of numbers that a storage may hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Float,
    Half,
    BFloat,
    Double,
    Long,
}

impl Kind {
    fn of(storage: &str) -> Option<Self> {
        Some(match storage {
            "FloatStorage" => Self::Float,
            "HalfStorage" => Self::Half,
            "BFloat16Storage" => Self::BFloat,
            "DoubleStorage" => Self::Double,
            "LongStorage" => Self::Long,
            _ => return None,
        })
    }

    /// The number at a place of a storage.
    pub(super) fn number(self, data: &[u8], at: usize) -> Option<f32> {
        match self {
            Self::Float => bytes_at(data, at).map(f32::from_le_bytes),
            Self::Half => bytes_at(data, at).map(|pair| half::f16::from_le_bytes(pair).to_f32()),
            Self::BFloat => bytes_at(data, at).map(|pair| half::bf16::from_le_bytes(pair).to_f32()),
            Self::Double => bytes_at(data, at).map(|eight| f64::from_le_bytes(eight) as f32),
            Self::Long => bytes_at(data, at).map(|eight| i64::from_le_bytes(eight) as f32),
        }
    }
}

fn bytes_at<const N: usize>(data: &[u8], at: usize) -> Option<[u8; N]> {
    let from = at.checked_mul(N)?;
    data.get(from..from.checked_add(N)?)?.try_into().ok()
}

/// Where a tensor's numbers lie in the archive.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Storage {
    pub(super) kind: Kind,
    /// Name of the archive's entry in `data/`.
    pub(super) key: String,
}

/// A tensor as it is described.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct TensorParts {
    pub(super) storage: Storage,
    /// Of its first number in the storage.
    pub(super) offset: usize,
    pub(super) shape: Vec<usize>,
    /// Numbers of the storage from one element to the next, for each dimension.
    pub(super) strides: Vec<usize>,
}

/// An object.
#[derive(Debug, Clone)]
pub(super) enum Item {
    /// Something that a state dict does not need.
    Other,
    Int(i64),
    Text(String),
    /// `module.name`.
    Global(String),
    Tuple(Vec<Id>),
    List(Vec<Id>),
    Dict(Vec<(Id, Id)>),
    Storage(Storage),
    Tensor(TensorParts),
}

/// All objects of a pickle.
#[derive(Debug)]
pub(super) struct Objects {
    items: Vec<Item>,
    root: Id,
}

impl Objects {
    /// The pickled object.
    pub(super) fn root(&self) -> Id {
        self.root
    }

    pub(super) fn item(&self, id: Id) -> &Item {
        &self.items[id]
    }
}

/// The machine at work.
pub(super) struct Machine<'a> {
    input: &'a [u8],
    items: Vec<Item>,
    stack: Vec<Id>,
    marks: Vec<usize>,
    memo: HashMap<u64, Id>,
}

type Step<T> = Result<T, String>;

impl<'a> Machine<'a> {
    /// Runs a pickle to its end.
    pub(super) fn run(input: &'a [u8]) -> Step<Objects> {
        let mut machine = Self {
            input,
            items: Vec::new(),
            stack: Vec::new(),
            marks: Vec::new(),
            memo: HashMap::new(),
        };
        loop {
            let instruction = machine.byte()?;
            if instruction == b'.' {
                let root = machine.pop()?;
                let items = machine.items;
                return Ok(Objects { items, root });
            }
            machine.step(instruction)?;
        }
    }

    fn step(&mut self, instruction: u8) -> Step<()> {
        match instruction {
            // PROTO, FRAME: nothing to do but to pass over their numbers.
            0x80 => self.skip(1),
            0x95 => self.skip(8),
            b'(' => {
                self.marks.push(self.stack.len());
                Ok(())
            }
            b'N' | 0x88 | 0x89 => self.push(Item::Other),
            b'G' => {
                self.skip(8)?;
                self.push(Item::Other)
            }
            b'K' | b'M' | b'J' | 0x8a => self.push_integer(instruction),
            b'X' | 0x8c | 0x8d => self.push_text(instruction),
            b'c' => {
                let (module, name) = (self.line()?, self.line()?);
                self.push(Item::Global(format!("{module}.{name}")))
            }
            0x93 => self.stack_global(),
            b')' => self.push(Item::Tuple(Vec::new())),
            b']' => self.push(Item::List(Vec::new())),
            b'}' => self.push(Item::Dict(Vec::new())),
            b't' => {
                let items = self.pop_to_mark()?;
                self.push(Item::Tuple(items))
            }
            0x85..=0x87 => self.short_tuple(usize::from(instruction - 0x84)),
            b'a' | b'e' => self.append(instruction),
            b's' | b'u' => self.set_items(instruction),
            b'q' | b'r' | 0x94 => self.memorize(instruction),
            b'h' | b'j' => self.recall(instruction),
            b'0' => self.pop().map(drop),
            b'Q' => self.persistent(),
            b'R' => self.reduce(),
            // BUILD sets attributes, which nobody asks for.
            b'b' => self.pop().map(drop),
            other => Err(format!(
                "its pickle has the instruction 0x{other:02x}, which a state dict does not need"
            )),
        }
    }

    fn byte(&mut self) -> Step<u8> {
        let (&first, rest) = self.input.split_first().ok_or_else(ended)?;
        self.input = rest;
        Ok(first)
    }

    fn take(&mut self, count: u64) -> Step<&'a [u8]> {
        let count = usize::try_from(count).map_err(|_| ended())?;
        let (taken, rest) = self.input.split_at_checked(count).ok_or_else(ended)?;
        self.input = rest;
        Ok(taken)
    }

    fn skip(&mut self, count: u64) -> Step<()> {
        self.take(count).map(drop)
    }

    /// A little-endian number of so many bytes.
    fn number(&mut self, bytes: u64) -> Step<u64> {
        let taken = self.take(bytes)?;
        Ok(taken
            .iter()
            .rev()
            .fold(0, |sum, &byte| sum << 8 | u64::from(byte)))
    }

    fn line(&mut self) -> Step<String> {
        let end = self.input.iter().position(|&byte| byte == b'\n');
        let line = self.take(end.ok_or_else(ended)? as u64)?;
        self.skip(1)?;
        text(line)
    }

    fn push(&mut self, item: Item) -> Step<()> {
        if self.items.len() >= MOST_OBJECTS {
            return Err(format!("its pickle makes more than {MOST_OBJECTS} objects"));
        }
        self.items.push(item);
        self.stack.push(self.items.len() - 1);
        Ok(())
    }

    /// Takes the top of the stack, but nothing from under a mark.
    fn pop(&mut self) -> Step<Id> {
        let floor = self.marks.last().copied().unwrap_or(0);
        if self.stack.len() <= floor {
            return Err("its pickle takes from an empty stack".to_owned());
        }
        self.stack.pop().ok_or_else(ended)
    }

    fn pop_to_mark(&mut self) -> Step<Vec<Id>> {
        let mark = self.marks.pop().ok_or("its pickle has a mark too few")?;
        Ok(self.stack.split_off(mark))
    }

    fn push_integer(&mut self, instruction: u8) -> Step<()> {
        let value = match instruction {
            b'K' => self.number(1)? as i64,
            b'M' => self.number(2)? as i64,
            b'J' => i64::from(self.number(4)? as u32 as i32),
            _ => {
                let bytes = self.number(1)?;
                if bytes > 8 {
                    return Err("its pickle has an integer of more than 64 bits".to_owned());
                }
                let value = self.number(bytes)?;
                let unused = 64 - 8 * bytes as u32;
                match unused {
                    64 => 0,
                    _ => (value << unused) as i64 >> unused,
                }
            }
        };
        self.push(Item::Int(value))
    }

    fn push_text(&mut self, instruction: u8) -> Step<()> {
        let length = self.number(match instruction {
            b'X' => 4,
            0x8c => 1,
            _ => 8,
        })?;
        let text = text(self.take(length)?)?;
        self.push(Item::Text(text))
    }

    fn stack_global(&mut self) -> Step<()> {
        let (name, module) = (self.pop()?, self.pop()?);
        match (&self.items[module], &self.items[name]) {
            (Item::Text(module), Item::Text(name)) => {
                let global = format!("{module}.{name}");
                self.push(Item::Global(global))
            }
            _ => Err("its pickle imports something without a name".to_owned()),
        }
    }

    fn short_tuple(&mut self, count: usize) -> Step<()> {
        let mut items = Vec::with_capacity(count);
        for _ in 0..count {
            items.push(self.pop()?);
        }
        items.reverse();
        self.push(Item::Tuple(items))
    }

    fn append(&mut self, instruction: u8) -> Step<()> {
        let new = match instruction {
            b'a' => vec![self.pop()?],
            _ => self.pop_to_mark()?,
        };
        match self.top()? {
            Item::List(items) => items.extend(new),
            _ => return Err("its pickle appends to something that is no list".to_owned()),
        }
        Ok(())
    }

    fn set_items(&mut self, instruction: u8) -> Step<()> {
        let new = match instruction {
            b's' => {
                let (value, key) = (self.pop()?, self.pop()?);
                vec![key, value]
            }
            _ => self.pop_to_mark()?,
        };
        match self.top()? {
            Item::Dict(entries) => {
                entries.extend(new.chunks_exact(2).map(|pair| (pair[0], pair[1])));
                Ok(())
            }
            // The attributes of an object that is not needed.
            Item::Other => Ok(()),
            _ => Err("its pickle sets items of something that is no dict".to_owned()),
        }
    }

    fn top(&mut self) -> Step<&mut Item> {
        let id = *self.stack.last().ok_or_else(ended)?;
        Ok(&mut self.items[id])
    }

    fn memorize(&mut self, instruction: u8) -> Step<()> {
        let key = match instruction {
            b'q' => self.number(1)?,
            b'r' => self.number(4)?,
            _ => self.memo.len() as u64,
        };
        let id = *self.stack.last().ok_or_else(ended)?;
        self.memo.insert(key, id);
        Ok(())
    }

    fn recall(&mut self, instruction: u8) -> Step<()> {
        let key = self.number(if instruction == b'h' { 1 } else { 4 })?;
        let id = self.memo.get(&key);
        let id = *id.ok_or("its pickle recalls what it did not memorize")?;
        self.stack.push(id);
        Ok(())
    }

    /// A storage: `("storage", type, key, device, count)`.
    fn persistent(&mut self) -> Step<()> {
        let id = self.pop()?;
        let Item::Tuple(parts) = &self.items[id] else {
            return Err("its pickle refers to a storage without description".to_owned());
        };
        let item = |at: usize| parts.get(at).map(|&id| &self.items[id]);
        let (Some(Item::Global(kind)), Some(Item::Text(key))) = (item(1), item(2)) else {
            return Err("its pickle refers to a storage without description".to_owned());
        };
        let name = kind.rsplit('.').next().unwrap_or_default();
        let kind = Kind::of(name).ok_or_else(|| format!("it holds a {name}, which is not read"))?;
        let key = key.clone();
        self.push(Item::Storage(Storage { kind, key }))
    }

    /// A call: only tensors, parameters and ordered dicts are made, everything else is passed over.
    fn reduce(&mut self) -> Step<()> {
        let (arguments, callee) = (self.pop()?, self.pop()?);
        let Item::Tuple(arguments) = &self.items[arguments] else {
            return Err("its pickle calls something without arguments".to_owned());
        };
        let item = match &self.items[callee] {
            Item::Global(name) => match name.as_str() {
                "collections.OrderedDict" => Item::Dict(Vec::new()),
                "torch._utils._rebuild_tensor_v2" => self.tensor(arguments)?,
                "torch._utils._rebuild_parameter" => self.parameter(arguments)?,
                _ => Item::Other,
            },
            _ => Item::Other,
        };
        self.push(item)
    }

    /// `(storage, offset, shape, strides, ...)`.
    fn tensor(&self, arguments: &[Id]) -> Step<Item> {
        let item = |at: usize| arguments.get(at).map(|&id| &self.items[id]);
        match (item(0), item(1), item(2), item(3)) {
            (
                Some(Item::Storage(storage)),
                Some(&Item::Int(offset)),
                Some(Item::Tuple(shape)),
                Some(Item::Tuple(strides)),
            ) => Ok(Item::Tensor(TensorParts {
                storage: storage.clone(),
                offset: usize::try_from(offset).map_err(|_| strange())?,
                shape: self.sides(shape)?,
                strides: self.sides(strides)?,
            })),
            _ => Err(strange()),
        }
    }

    fn sides(&self, items: &[Id]) -> Step<Vec<usize>> {
        let side = |&id: &Id| match self.items[id] {
            Item::Int(side) => usize::try_from(side).map_err(|_| strange()),
            _ => Err(strange()),
        };
        items.iter().map(side).collect()
    }

    /// `(tensor, requires_grad, hooks)`.
    fn parameter(&self, arguments: &[Id]) -> Step<Item> {
        match arguments.first().map(|&id| &self.items[id]) {
            Some(tensor @ Item::Tensor(_)) => Ok(tensor.clone()),
            _ => Err(strange()),
        }
    }
}

fn text(bytes: &[u8]) -> Step<String> {
    String::from_utf8(bytes.to_vec()).map_err(|_| "its pickle has text that is none".to_owned())
}

fn ended() -> String {
    "its pickle ends too early".to_owned()
}

fn strange() -> String {
    "its pickle describes a tensor in an unknown way".to_owned()
}
