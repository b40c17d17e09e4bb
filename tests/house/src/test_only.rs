//! What is built for tests alone.

use syn::punctuated::Punctuated;
use syn::{Attribute, Item, Meta, Token};

/// Whether these attributes keep what they stand at out of every build but that of the tests.
pub(crate) fn is_test_only(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("test")
            || (attribute.path().is_ident("cfg")
                && attribute
                    .parse_args::<Meta>()
                    .is_ok_and(|condition| without_tests(&condition) == Some(false)))
    })
}

/// Whether an item is built for tests alone.
pub(crate) fn is_test_only_item(item: &Item) -> bool {
    is_test_only(match item {
        Item::Const(item) => &item.attrs,
        Item::Enum(item) => &item.attrs,
        Item::ExternCrate(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        Item::ForeignMod(item) => &item.attrs,
        Item::Impl(item) => &item.attrs,
        Item::Macro(item) => &item.attrs,
        Item::Mod(item) => &item.attrs,
        Item::Static(item) => &item.attrs,
        Item::Struct(item) => &item.attrs,
        Item::Trait(item) => &item.attrs,
        Item::TraitAlias(item) => &item.attrs,
        Item::Type(item) => &item.attrs,
        Item::Union(item) => &item.attrs,
        Item::Use(item) => &item.attrs,
        _ => &[],
    })
}

/// The value of a condition where tests are not built, as far as that decides it.
fn without_tests(condition: &Meta) -> Option<bool> {
    if condition.path().is_ident("test") {
        return Some(false);
    }
    let Meta::List(list) = condition else {
        return None;
    };
    let parts = list
        .parse_args_with(Punctuated::<Meta, Token![,]>::parse_terminated)
        .ok()?
        .iter()
        .map(without_tests)
        .collect::<Vec<_>>();
    if list.path.is_ident("not") {
        return parts.first().copied().flatten().map(|value| !value);
    }
    let decisive = list.path.is_ident("any");
    if parts.contains(&Some(decisive)) {
        Some(decisive)
    } else if parts.iter().all(|part| *part == Some(!decisive)) {
        Some(!decisive)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_left_out(source: &str) -> bool {
        is_test_only_item(&syn::parse_str(source).unwrap())
    }

    #[test]
    fn conditions_that_need_tests_are_told_from_those_that_do_not() {
        for source in [
            "#[test] fn f() {}",
            "#[cfg(test)] fn f() {}",
            "#[cfg(all(test, unix))] fn f() {}",
            "#[cfg(not(any(not(test), unix)))] fn f() {}",
        ] {
            assert!(is_left_out(source), "{source}");
        }
        for source in [
            "fn f() {}",
            "#[cfg(not(test))] fn f() {}",
            "#[cfg(any(test, feature = \"train\"))] fn f() {}",
            "#[cfg(all(unix, feature = \"test\"))] fn f() {}",
        ] {
            assert!(!is_left_out(source), "{source}");
        }
    }
}
