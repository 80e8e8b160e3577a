"""Schedulers that clients reach by TLS only."""

import shutil
import subprocess

import pytest

from gltf_ext import scheduler
from gltf_ext.errors import MeshletError

dask = pytest.importorskip("dask")
distributed = pytest.importorskip("distributed")


@pytest.fixture
def certificate(tmp_path):
    """A file with a key and its certificate, which also signs for itself."""
    path = tmp_path / "certificate.pem"
    command = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2"]
    command += ["-subj", "/CN=localhost", "-keyout", path.with_suffix(".key"), "-out", path]
    if not shutil.which("openssl"):
        pytest.skip("needs openssl")
    subprocess.run(command, check=True, capture_output=True)
    path.write_bytes(path.read_bytes() + path.with_suffix(".key").read_bytes())
    return str(path)


@pytest.fixture
def secure(certificate):
    """Dask's configuration of a cluster with TLS, and the address of its scheduler."""
    roles = ("client", "worker", "scheduler")
    settings = {f"distributed.comm.tls.{role}.cert": certificate for role in roles}
    settings["distributed.comm.tls.ca-file"] = certificate
    with (
        dask.config.set(settings),
        distributed.LocalCluster(
            n_workers=1,
            threads_per_worker=1,
            processes=False,
            dashboard_address=None,
            protocol="tls",
            security=distributed.Security(),
        ) as cluster,
    ):
        yield settings, cluster.scheduler_address


@pytest.fixture
def loader():
    """Configures a function of this module as what gives clients their certificates."""
    with dask.config.set({"distributed.client.security-loader": f"{__name__}.loaded"}):
        yield loaded_settings
    loaded_settings.clear()


loaded_settings: dict = {}


def loaded(info):
    with dask.config.set(loaded_settings):
        return distributed.Security()


def test_a_scheduler_with_tls(secure):
    _, address = secure
    assert address.startswith("tls://")
    with scheduler.connected(address) as client:
        assert client.submit(len, "ab").result() == 2


def test_a_scheduler_with_tls_whose_certificates_are_loaded(secure, loader):
    settings, address = secure
    loader.update(settings)
    with dask.config.set(dict.fromkeys(settings)), scheduler.connected(address) as client:
        assert client.submit(len, "ab").result() == 2


def refused(address):
    """Whether an error names what has to be configured."""
    with pytest.raises(MeshletError) as error, scheduler.connected(address):
        pass
    return str(error.value).endswith("; set distributed.comm.tls of Dask")


def test_tls_without_certificates(secure):
    settings, address = secure
    with dask.config.set(dict.fromkeys(settings)):
        assert refused(address)


def test_a_scheduler_without_the_tls_that_is_required():
    with dask.config.set({"distributed.comm.require-encryption": True}):
        assert refused("tcp://127.0.0.1:9")
