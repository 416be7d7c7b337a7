"""The node that publishes images and their intrinsics from any source."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
import threading

from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from depth_person.camera.calibration import is_preset
from depth_person.camera.deblur import wiener_deblur
from depth_person.camera.frame import Frame
from depth_person.camera.intrinsics import Intrinsics
from depth_person.camera.optics import Size, Uncalibrated
from depth_person.camera.presets import preset_uncertainty
from depth_person.camera.source import Source
from depth_person.camera.sources import is_live, open_source
from depth_person.errors import DepthPersonError
from depth_person.nodes.base import StageNode
from depth_person.nodes.calibration_service import CalibrationService
from depth_person.nodes.frame_reader import FrameReader
from depth_person.nodes.image_messages import encode_camera_info, encode_image, encode_jpeg, header
from depth_person.nodes.monitor import Level
from depth_person.nodes.subscribers import wait_for_subscribers
from depth_person.settings.camera import CameraSettings
from depth_person.settings.parameter import ParameterValue

#: Power of the noise over that of the image, for the Wiener filter: good light.
_NOISE_TO_SIGNAL = 0.01


class CameraNode(StageNode[CameraSettings]):
    """
    Publishes image_raw, image_raw/compressed and camera_info, and serves set_camera_info.

    Images are encoded only for who subscribes; camera_info is always published.

    :param deliver: takes every frame in memory before it is published.
    :param has_subscribers: whether anyone awaits what comes of frames delivered in memory.
    :raises DepthPersonError: when parameters are wrong. A calibration that cannot be read keeps
        it from being configured; a recording that cannot, ends it; a live source may come later.
    """

    def __init__(
        self, *, overrides: Mapping[str, ParameterValue] | None = None,
        deliver: Callable[[Frame], None] | None = None,
        has_subscribers: Callable[[], bool] = lambda: False,
    ) -> None:
        super().__init__('camera_node', CameraSettings, overrides=overrides)
        self._deliver = deliver
        self._has_subscribers = has_subscribers
        self._ended = threading.Event()

    def configure(self) -> None:
        """Make the topics, and look at what is to be read."""
        settings = self.settings
        if not settings.source:
            raise DepthPersonError(
                'no source is given; set the parameter source to a video file, a folder of '
                'images, a device such as /dev/video0, a stream URL or a bag')
        self._blur = settings.blur_kernel()
        self._optics = settings.optics()
        self._sizes: tuple[Size, ...] = ()
        if is_preset(settings.camera_info_url):
            self._warn_of_preset(settings.camera_info_url)
        self._image = self.advertise(Image, 'image_raw')
        self._compressed = self.advertise(CompressedImage, 'image_raw/compressed')
        self._camera_info = self.advertise(CameraInfo, 'camera_info')
        CalibrationService(
            self, url=settings.camera_info_url, check=self._check_size, take=self._recalibrate)
        self._on_clock = self._make_clock() if settings.publish_clock else None
        self._reader: FrameReader | None = None
        self.work('camera', self._run)

    def deactivate(self) -> None:
        """End the wait for the next frame, and let go of a live source."""
        if self._reader is not None:
            self._reader.interrupt()

    @property
    def finished(self) -> bool:
        """Whether the source has ended and its last frame has been published."""
        return self._ended.is_set()

    def _open_source(self) -> Source:
        settings = self.settings
        return open_source(
            settings.source, frame_id=settings.frame_id, fps=settings.fps or None,
            loop=settings.loop, image_topic=settings.image_topic or None,
            clock=lambda: self.now_ns, timeout_s=settings.timeout,
            device=settings.device_options(), rtsp_transport=settings.rtsp_transport)

    def _run(self, stopping: threading.Event) -> None:
        """Read from the source's present, or a recording's first frame, until told to stop."""
        self._reader = FrameReader(
            self._open_source, live=is_live(self.settings.source), monitor=self.monitor,
            stopping=stopping, on_clock=self._on_clock)
        if self.settings.wait_for_subscribers:
            wait_for_subscribers(self._count_subscribers, stopping)
        for frame in self._reader.frames():
            self._publish(self._calibrated(self._shifted(self._sharpened(frame))))
        if not stopping.is_set():
            self._ended.set()

    def _count_subscribers(self) -> int:
        return (self._image.get_subscription_count()
                + self._compressed.get_subscription_count() + self._has_subscribers())

    def _sharpened(self, frame: Frame) -> Frame:
        if self._blur is None:
            return frame
        return replace(frame, image=wiener_deblur(
            frame.image, self._blur, noise_to_signal=_NOISE_TO_SIGNAL))

    def _shifted(self, frame: Frame) -> Frame:
        offset_ns = round(self.settings.time_offset * 1e9)
        return replace(frame, stamp_ns=frame.stamp_ns + offset_ns) if offset_ns else frame

    def _calibrated(self, frame: Frame) -> Frame:
        """Return the frame as wide as it shall be, with its intrinsics if there are any."""
        optics = self._optics
        height, width = frame.image.shape[:2]
        frame = optics.shrink(frame)
        self._note_sizes((width, height), frame.image.shape[1::-1])
        intrinsics: Intrinsics | None = None
        try:
            intrinsics = optics.intrinsics(frame, taken=(width, height))
        except Uncalibrated as error:
            self.monitor.fault('calibration', Level.WARN, str(error))
        except DepthPersonError as error:
            self.monitor.fault('calibration', Level.ERROR, str(error))
        else:
            self.monitor.clear('calibration')
        return frame if intrinsics is frame.intrinsics else replace(frame, intrinsics=intrinsics)

    def _note_sizes(self, *sizes: Size) -> None:
        """Note the sizes of the image before and after shrink."""
        if self._sizes not in ((), sizes):
            (width, height), (new_width, new_height) = self._sizes[0], sizes[0]
            self.get_logger().warning(
                f'the images have changed from {width}x{height} to {new_width}x{new_height} px; a '
                'calibration fits only one of them', throttle_duration_sec=10.0)
        self._sizes = sizes

    def _check_size(self, intrinsics: Intrinsics) -> None:
        """Raise that a calibration that is handed over is of another size than the images."""
        size = (intrinsics.width, intrinsics.height)
        if self._sizes and size not in self._sizes:
            width, height = self._sizes[-1]
            raise DepthPersonError(
                f'the calibration is for {size[0]}x{size[1]} px, the images have '
                f'{width}x{height}; it is not taken')

    def _recalibrate(self, intrinsics: Intrinsics) -> None:
        self._optics = replace(self._optics, calibration=intrinsics)
        self.monitor.value('calibration', 'set by set_camera_info')

    def _warn_of_preset(self, url: str) -> None:
        percent = 100 * preset_uncertainty(url.partition('://')[2])
        text = (f'{url}: nominal, the focal length is good to about {percent:g} %, and so are '
                'distances; lens distortion is left out')
        self.monitor.value('calibration', text)
        self.get_logger().warning(text)

    def _publish(self, frame: Frame) -> None:
        if self._deliver is not None:
            self._deliver(frame)
        image_header = header(stamp_ns=frame.stamp_ns, frame_id=frame.frame_id)
        height, width = frame.image.shape[:2]
        self._camera_info.publish(
            encode_camera_info(frame.intrinsics, image_header, width=width, height=height))
        if self._image.get_subscription_count():
            self._image.publish(encode_image(frame.image, image_header))
        if self._compressed.get_subscription_count():
            self._compressed.publish(
                encode_jpeg(frame.image, image_header, quality=self.settings.jpeg_quality))
        self.monitor.frame()
        self.monitor.latency(stamp_ns=frame.stamp_ns, now_ns=self.now_ns)

    def _make_clock(self) -> Callable[[int], None]:
        publisher = self.advertise(ClockMessage, '/clock')
        return lambda stamp_ns: publisher.publish(
            ClockMessage(clock=header(stamp_ns=stamp_ns, frame_id='').stamp))
