"""Scans that come too seldom for autopilots are reported, and only those."""
from types import SimpleNamespace

from test_autopilot_messages import ahead, CAMERA, IMAGE

from depth_person.autopilot.vehicle import CameraOnBody
from depth_person.distance.estimator import Mounting
from depth_person.nodes.autopilot_outputs import AutopilotOutputs
from depth_person.nodes.monitor import Monitor
from depth_person.settings.depth import DepthSettings


def test_only_the_time_in_which_there_were_scans_counts_for_their_rate(monkeypatch):
    now = SimpleNamespace(s=100.0)
    monkeypatch.setattr('depth_person.nodes.autopilot_outputs.time',
                        SimpleNamespace(monotonic=lambda: now.s))
    publisher = SimpleNamespace(publish=lambda _: None, get_subscription_count=lambda: 1)
    monitor = Monitor(lambda *_: None)
    outputs = AutopilotOutputs(SimpleNamespace(
        monitor=monitor, settings=DepthSettings(), advertise=lambda *_: publisher))

    def complaint(*, silent_s, scans, period_s):
        now.s += silent_s
        for _ in range(scans):
            outputs.publish(ahead(), IMAGE, CAMERA, Mounting(), CameraOnBody.mounted())
            now.s += period_s
        outputs.check()
        return 'scans a second' in monitor.status('').message

    assert not complaint(silent_s=0.7, scans=3, period_s=0.1)  # the first ones of all
    assert not complaint(silent_s=0.0, scans=10, period_s=0.1)
    assert complaint(silent_s=0.0, scans=5, period_s=0.2)
    outputs.forget()
    assert not complaint(silent_s=60.0, scans=3, period_s=0.1)  # inactive for a minute
    assert not complaint(silent_s=1.0, scans=0, period_s=0.1)
    assert not complaint(silent_s=0.7, scans=3, period_s=0.1)
    assert complaint(silent_s=0.7, scans=3, period_s=0.1)
