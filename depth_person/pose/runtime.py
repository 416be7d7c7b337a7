"""One way to open a network with ONNX Runtime."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
import os
from pathlib import Path
from typing import Any
import warnings

import numpy as np
from numpy.typing import NDArray
import onnxruntime

from depth_person.errors import DepthPersonError

#: Short names of ONNX Runtime's execution providers.
PROVIDERS = {
    'cpu': 'CPUExecutionProvider',
    'cuda': 'CUDAExecutionProvider',
    'tensorrt': 'TensorrtExecutionProvider',
    'openvino': 'OpenVINOExecutionProvider',
}

#: ONNX Runtime starts as many as it is told to, and hangs over a hundred thousand.
MOST_THREADS = 256

#: The smallest ONNX file: y = x for one float. It shows whether a provider's libraries load.
_SMALLEST = (
    b'\x08\x08\x12\x00:7\n\x10\n\x01x\x12\x01y"\x08Identity\x12\x01gZ\x0f\n\x01x\x12\n\n\x08'
    b'\x08\x01\x12\x04\n\x02\x08\x01b\x0f\n\x01y\x12\n\n\x08\x08\x01\x12\x04\n\x02\x08\x01B\x04'
    b'\n\x00\x10\r')


class Session(onnxruntime.InferenceSession):
    """
    A session whose faults at a run are told as all others are.

    :ivar name: of the network, for messages.
    """

    name = 'the network'

    def run(
        self, output_names: Sequence[str] | None, input_feed: Mapping[str, NDArray[Any]],
        run_options: onnxruntime.RunOptions | None = None,
    ) -> list[Any]:
        """Return outputs; raise DepthPersonError when the network cannot be run on the inputs."""
        try:
            return list(super().run(output_names, input_feed, run_options))
        except Exception as error:  # its exceptions have no common base class but this
            given = ', '.join(
                f'{value.shape} of {value.dtype}' for value in input_feed.values())
            remedy = '' if self.get_providers()[0] == PROVIDERS['cpu'] else (
                '; it may run with provider: cpu')
            raise DepthPersonError(
                f'{self.name} does not run on a tensor {given}: {error}{remedy}') from error


def check_finite(values: NDArray[Any], *, output: str, network: str | Path) -> None:
    """Raise DepthPersonError where an output of a network holds NaN or infinity."""
    if not np.isfinite(values).all():
        raise DepthPersonError(
            f'the output {output} of {network} holds NaN or infinity; the network is damaged, or '
            'fails at its precision')


def halves(threads: int) -> tuple[int, int]:
    """
    Return how many threads each of two networks may use that run side by side.

    The second has the odd one; the first has none where there is but one for both.

    :param threads: that one alone may use; 0 for one a core.
    """
    threads = threads or len(os.sched_getaffinity(0))
    return threads // 2, threads - threads // 2


def settle_provider(provider: str, *, fallback: bool) -> tuple[str, str]:
    """
    Return the provider to use, and what is worth a warning; no text where it is as wanted.

    A provider is usable when this build of ONNX Runtime has it and the smallest network runs on
    it.

    :param provider: one of PROVIDERS.
    :param fallback: whether the CPU may stand in.
    :raises DepthPersonError: when it is not usable and nothing may stand in.
    """
    if _usable(provider):
        return provider, ''
    missing = _missing(provider)
    if not fallback:
        raise DepthPersonError(f'{missing}, or allow the CPU with provider_fallback: true')
    return 'cpu', f'the network runs on the CPU, slower: {missing}'


def open_session(
    path: Path, *, threads: int = 0, provider: str = 'cpu',
    remedy: str = 'install the model again: depth_person models install',
) -> Session:
    """
    Return a session of the network in an ONNX file.

    :param threads: that one run may use, at most MOST_THREADS; 0 for one a core.
    :param provider: one of PROVIDERS; single operations that it cannot run fall to the CPU.
    :param remedy: what to do when the file is no network.
    :raises DepthPersonError: when the provider is not there or cannot run this network, or the
        file is no network.
    """
    if not 0 <= threads <= MOST_THREADS:
        raise DepthPersonError(f'threads {threads} is not from 0 to {MOST_THREADS}')
    if not _usable(provider):
        raise DepthPersonError(_missing(provider))
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.inter_op_num_threads = 1
    options.log_severity_level = 4  # what goes wrong is raised, and told once by the caller
    # Threads that wait by spinning make the bare network up to a quarter faster on a quiet
    # machine, but not the whole pipeline, whose other stages need the time that they burn: even
    # 30 us of it at a time halved the frames that are taken from a camera of 60 a second.
    options.add_session_config_entry('session.intra_op.allow_spinning', '0')
    try:
        session = _session(str(path), options, provider)
        session.name = str(path)
    except Exception as error:  # its exceptions have no common base class but this
        if provider != 'cpu':
            # Raises when it is the file that is at fault.
            open_session(path, threads=threads, remedy=remedy)
            raise DepthPersonError(
                f'the provider {provider!r} cannot run {path}: {error}; choose another provider, '
                'such as cpu') from error
        raise DepthPersonError(
            f'ONNX Runtime cannot open {path}: {error}; {remedy}') from error
    return session


def _session(
    network: str | bytes, options: onnxruntime.SessionOptions, provider: str,
) -> Session:
    """Return a session that really has a provider; raise what ONNX Runtime raises."""
    # Left to itself, it goes on without a provider that fails, and only prints that.
    providers: list[str | tuple[str, dict[str, str]]] = [*_with_helpers(provider)]
    if provider == 'openvino' and options.intra_op_num_threads:
        # It has threads of its own, and does not ask how many the session may have.
        providers[0] = (
            PROVIDERS[provider], {'num_of_threads': str(options.intra_op_num_threads)})
    session = Session(network, options, providers, enable_fallback=0)
    session.disable_fallback()
    if PROVIDERS[provider] not in session.get_providers():
        raise RuntimeError(f'it left {PROVIDERS[provider]} out')
    return session


def _with_helpers(provider: str) -> list[str]:
    """Return a provider and those that take what it cannot run, in order."""
    names = [provider, *(['cuda'] if provider == 'tensorrt' else []), 'cpu']
    here = onnxruntime.get_available_providers()
    return [PROVIDERS[name] for name in dict.fromkeys(names) if PROVIDERS[name] in here]


@lru_cache
def _usable(provider: str) -> bool:
    wanted = PROVIDERS.get(provider)
    if provider == 'cpu' or wanted not in onnxruntime.get_available_providers():
        return provider == 'cpu'
    options = onnxruntime.SessionOptions()
    options.log_severity_level = 4  # a library that does not load is told by _missing
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')
        try:
            _session(_SMALLEST, options, provider).run(None, {'x': np.zeros(1, np.float32)})
        except Exception:  # see open_session
            return False
    return True


def _missing(provider: str) -> str:
    """Return that a provider is not there, what is, and what to do."""
    available = onnxruntime.get_available_providers()
    if PROVIDERS.get(provider) in available:
        return (f"the libraries of ONNX Runtime's provider {provider!r} do not load or run "
                'here. Install what it needs (its driver and libraries, in the versions that this '
                'build of ONNX Runtime wants)')
    here = ', '.join(name for name, full in PROVIDERS.items() if full in available)
    return (f'ONNX Runtime has no provider {provider!r} here; it has {here}. '
            'Choose one of these, or install the ONNX Runtime build that brings it')
