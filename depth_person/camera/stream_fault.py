"""Why a stream cannot be opened, which OpenCV does not say."""
from __future__ import annotations

import socket
from urllib.parse import SplitResult, urlsplit, urlunsplit

from depth_person.camera.source import mask_password, SourceUnusable
from depth_person.errors import DepthPersonError

_PORTS = {'rtsp': 554, 'http': 80}
_TIMEOUT_S = 2.0


def stream_fault(url: str) -> DepthPersonError:
    """
    Return the error to be raised for a stream that has not opened.

    Asks the server once more, without user and password, what it says of the stream.

    :param url: a URL, or the path of an SDP file.
    """
    name = f'stream {mask_password(url)} cannot be opened'
    try:
        parts = urlsplit(url)
        port = parts.port or _PORTS.get(parts.scheme.lower())
    except ValueError:
        return SourceUnusable(
            f'{name}: host or port is not valid; write @, : and / in a password as %40, %3A, %2F')
    if parts.scheme.lower() not in _PORTS:
        return DepthPersonError(
            f'{name}: nobody sends there yet, or what comes is no video; check the sender and its '
            'address')
    if not parts.hostname:
        return SourceUnusable(f'{name}: it names no host; write {parts.scheme}://HOST/PATH')
    try:
        status = _ask(parts, port or 0)
    except socket.gaierror:
        return DepthPersonError(f'{name}: there is no host {parts.hostname}; check the name, and '
                                'the network')
    except ConnectionRefusedError:
        return DepthPersonError(f'{name}: {parts.hostname} refuses connections on port {port}; '
                                'check the port, and that the server runs')
    except (OSError, ValueError):
        return DepthPersonError(f'{name}: {parts.hostname} does not answer on port {port}; check '
                                'address and network')
    return _verdict(name, status, authorised=parts.username is not None)


def _verdict(name: str, status: int, *, authorised: bool) -> DepthPersonError:
    if status in (401, 403):
        return SourceUnusable(
            f'{name}: the server does not take this user and password, or has no such stream'
            if authorised else
            f'{name}: the server wants a user and password; write ://USER:PASSWORD@ in the URL')
    if status == 404:
        return DepthPersonError(f'{name}: the server has no such stream (404); check the path')
    if status >= 400:
        return DepthPersonError(f'{name}: the server answers with status {status}')
    return DepthPersonError(
        f'{name}: the server is there, but sends no video that can be read; try the URL in a '
        'player, and rtsp_transport')


def _ask(parts: SplitResult, port: int) -> int:
    """
    Return the status code of the server's answer to a request for the stream.

    :raises OSError: when there is no connection.
    :raises ValueError: when the answer is none.
    """
    host = f'{parts.hostname}:{port}'
    rtsp = parts.scheme.lower() == 'rtsp'
    if rtsp:
        target = urlunsplit((parts.scheme, host, parts.path, parts.query, ''))
        request = f'DESCRIBE {target} RTSP/1.0\r\nCSeq: 1\r\nAccept: application/sdp\r\n\r\n'
    else:
        target = urlunsplit(('', '', parts.path or '/', parts.query, ''))
        request = f'GET {target} HTTP/1.0\r\nHost: {host}\r\n\r\n'
    with socket.create_connection((parts.hostname, port), _TIMEOUT_S) as connection:
        connection.settimeout(_TIMEOUT_S)
        connection.sendall(request.encode())
        line = connection.recv(64).split()  # such as RTSP/1.0 404 Not Found
    if len(line) < 2:
        raise ValueError('no status line')
    return int(line[1])
