//! Takes that go wrong.
