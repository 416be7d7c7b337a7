"""One way to open a network with ONNX Runtime."""
from __future__ import annotations

from pathlib import Path

import onnxruntime

from depth_person.errors import DepthPersonError

#: Short names of ONNX Runtime's execution providers.
PROVIDERS = {
    'cpu': 'CPUExecutionProvider',
    'cuda': 'CUDAExecutionProvider',
    'tensorrt': 'TensorrtExecutionProvider',
    'openvino': 'OpenVINOExecutionProvider',
}


def open_session(
    path: Path, *, threads: int = 0, provider: str = 'cpu',
    remedy: str = 'install the model again: depth_person models install',
) -> onnxruntime.InferenceSession:
    """
    Return a session of the network in an ONNX file.

    :param threads: that one run may use; 0 for one a core.
    :param provider: one of PROVIDERS; what it cannot run falls to the CPU.
    :param remedy: what to do when the file is no network.
    :raises DepthPersonError: when the provider is not there, or the file is no network.
    """
    available = onnxruntime.get_available_providers()
    wanted = PROVIDERS.get(provider)
    if wanted not in available:
        here = ', '.join(name for name, full in PROVIDERS.items() if full in available)
        raise DepthPersonError(
            f'ONNX Runtime has no provider {provider!r} here; it has {here}. '
            'Choose one of these, or install the ONNX Runtime build that brings it')
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.inter_op_num_threads = 1
    options.log_severity_level = 3  # errors: its warnings are not for users
    # Threads that wait by spinning make the bare network up to a quarter faster on a quiet
    # machine, but not the whole pipeline, whose other stages need the time that they burn.
    options.add_session_config_entry('session.intra_op.allow_spinning', '0')
    providers = list(dict.fromkeys([wanted, PROVIDERS['cpu']]))
    try:
        return onnxruntime.InferenceSession(str(path), options, providers)
    except Exception as error:  # its exceptions have no common base class but this
        raise DepthPersonError(
            f'ONNX Runtime cannot open {path}: {error}; {remedy}') from error
