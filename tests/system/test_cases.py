"""Every case of the virtual machine, all in one boot: pytest -m system tests/system."""

import pytest

from . import vm
from .image import ImageError

pytestmark = pytest.mark.system


@pytest.fixture(scope="session")
def results() -> dict[str, vm.Result]:
    try:
        return vm.run(vm.names())
    except ImageError as error:
        pytest.skip(str(error))


@pytest.mark.parametrize("name", vm.names())
def test_the_case_goes_as_it_should(name: str, results: dict[str, vm.Result]) -> None:
    result = results[name]
    assert result.ok, f"{'; '.join(result.found)}\n{result.log[-4000:]}"
