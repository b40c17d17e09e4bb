"""What the package offers is what its stubs and docstrings say."""

import ast
import inspect
import pathlib

import relit


def test_stubs_have_the_names_and_parameters_of_the_package():
    tree = ast.parse(pathlib.Path(relit.__file__).with_suffix(".pyi").read_text())
    functions = {node.name: node.args for node in tree.body if isinstance(node, ast.FunctionDef)}
    classes = {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}
    assert set(functions) | set(classes) | {"__version__"} == set(relit.__all__)
    for name, arguments in functions.items():
        found = inspect.signature(getattr(relit, name)).parameters.values()
        listed = [one.arg for one in arguments.args + arguments.kwonlyargs] + ([arguments.kwarg.arg] if arguments.kwarg else [])
        assert [one.name for one in found] == listed, name
    for name in ("Decomposition", "Turn", "Batch"):
        listed = [node.target.id for node in classes[name].body if isinstance(node, ast.AnnAssign)]
        assert listed == [field for field in getattr(relit, name).__dataclass_fields__], name


def test_every_function_says_what_it_takes():
    for name in relit.__all__:
        described = inspect.getdoc(getattr(relit, name))
        assert described, name
        if inspect.isfunction(getattr(relit, name)):
            missing = [one for one in inspect.signature(getattr(relit, name)).parameters if one not in described]
            assert not missing, (name, missing)
