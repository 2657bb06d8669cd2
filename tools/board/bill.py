#!/usr/bin/env python3
"""A bill of materials, CycloneDX 1.5 in JSON, made from what is packed.

bill.py deb FILE.deb DEBS                    of a package: its files; what it depends on, as it was linked against
bill.py image SLOT_ROOT INITRAMFS BOOT DEBS PACKAGE...
                                             of an image: each file that a Debian package brought, that we brought, or
                                             that the build made

DEBS has the packages that were downloaded (tools/board/apt.sh), as NAME:ARCH.deb. A Debian package stands in the bill
of an image when a file of it is in there, the same byte for byte or packed by gzip; with its version, the SHA-256 of the .deb, and how many
of its files are packed. A PACKAGE may also be the package URL of a library that the program is linked with. The same input gives the same bytes; the time is SOURCE_DATE_EPOCH.
"""

import datetime
import gzip
import hashlib
import io
import json
import os
import re
import subprocess
import sys
import tarfile
import uuid

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")


def run(*arguments):
    return subprocess.run(arguments, check=True, stdout=subprocess.PIPE).stdout


def digest_of(content):
    return hashlib.sha256(content).hexdigest()


def digest_of_file(path):
    with open(path, "rb") as file:
        return digest_of(file.read())


def digest_unpacked(path):
    """Of what a file has that gzip packed; nothing of another one."""
    try:
        with gzip.open(path) as file:
            return digest_of(file.read())
    except gzip.BadGzipFile:
        return None


def hashes(digest):
    return [{"alg": "SHA-256", "content": digest}]


def version():
    with open(os.path.join(ROOT, "CMakeLists.txt"), encoding="ascii") as file:
        return re.search(r"project\(isohead VERSION ([0-9.]+)", file.read())[1]


def files_of_deb(path):
    """Path to digest, of its regular files."""
    with tarfile.open(fileobj=io.BytesIO(run("dpkg-deb", "--fsys-tarfile", path))) as tar:
        return {member.name[1:]: digest_of(tar.extractfile(member).read()) for member in tar if member.isfile()}


def fields_of_deb(path):
    text = run("dpkg-deb", "--field", path, "Package", "Version", "Architecture", "Source", "Depends").decode()
    return dict(line.split(": ", 1) for line in text.splitlines() if ": " in line)


def debian_component(path, **more):
    fields = fields_of_deb(path)
    name, its_version, arch = fields["Package"], fields["Version"], fields["Architecture"]
    purl = f"pkg:deb/debian/{name}@{its_version.replace('+', '%2B').replace(':', '%3A')}?arch={arch}"
    properties = {"source": fields.get("Source", name).split(" ")[0], **more}
    return {"type": "library", "bom-ref": purl, "name": name, "version": its_version, "purl": purl,
            "hashes": hashes(digest_of_file(path)),
            "properties": [{"name": "isohead:" + key, "value": str(value)} for key, value in sorted(properties.items())]}


def linked_component(purl):
    name, its_version = purl.rsplit("/", 1)[1].split("@")
    return {"type": "library", "bom-ref": purl, "name": name, "version": its_version, "purl": purl,
            "properties": [{"name": "isohead:packed", "value": "in the program"}]}


def file_component(name, digest, origin):
    return {"type": "file", "name": name, "hashes": hashes(digest),
            "properties": [{"name": "isohead:origin", "value": origin}]}


def bill(name, kind, components):
    """The document; its serial number is that of its content."""
    time = datetime.datetime.fromtimestamp(int(os.environ.get("SOURCE_DATE_EPOCH", "0")), datetime.timezone.utc)
    components.sort(key=lambda component: (component["type"], component["name"]))
    document = {"bomFormat": "CycloneDX", "specVersion": "1.5", "version": 1,
                "metadata": {"timestamp": time.strftime("%Y-%m-%dT%H:%M:%SZ"),
                             "component": {"type": kind, "bom-ref": "isohead", "name": name, "version": version()}},
                "components": components,
                "dependencies": [{"ref": "isohead", "dependsOn": [component["bom-ref"] for component in components
                                                                  if "bom-ref" in component]}]}
    content = json.dumps(document, sort_keys=True)
    document["serialNumber"] = "urn:uuid:" + str(uuid.uuid5(uuid.NAMESPACE_OID, content))
    json.dump(document, sys.stdout, indent=1, sort_keys=True)
    print()


def of_deb(path, debs):
    fields = fields_of_deb(path)
    components = [file_component(name, digest, "packed") for name, digest in files_of_deb(path).items()]
    for item in fields["Depends"].split(", "):
        name, _, wanted = item.partition(" ")
        deb = os.path.join(debs, f"{name}:{fields['Architecture']}.deb")
        if os.path.exists(deb):
            components.append(debian_component(deb, packed="no", depends=wanted.strip("()")))
        else:  # a program of the system's, not linked against
            components.append({"type": "application", "bom-ref": name, "name": name,
                               "properties": [{"name": "isohead:packed", "value": "no"}]})
    bill(f"isohead ({fields['Architecture']})", "application", components)


def of_image(root, initramfs, boot, debs, packages):
    linked = [package for package in packages if package.startswith("pkg:")]
    paths = [os.path.join(debs, package + ".deb") for package in sorted(set(packages) - set(linked))]
    owners = {}
    for path in paths:
        for digest in files_of_deb(path).values():
            owners.setdefault(digest, path)
    counts, components = dict.fromkeys(paths, 0), []
    for tree, prefix in ((root, "slot"), (initramfs, "initramfs"), (boot, "boot")):
        for folder, _, names in os.walk(tree):
            for name in names:
                path = os.path.join(folder, name)
                if os.path.islink(path) or not os.path.isfile(path):
                    continue
                digest = digest_of_file(path)
                owner = owners.get(digest) or owners.get(digest_unpacked(path))
                if owner:
                    counts[owner] += 1
                else:
                    components.append(file_component(prefix + "/" + os.path.relpath(path, tree), digest, "isohead or its build"))
    components += [debian_component(path, packed="yes", files=count) for path, count in counts.items() if count > 0]
    components += [linked_component(purl) for purl in linked]
    bill("isohead image (arm64)", "firmware", components)


def main():
    arguments = sys.argv[2:]
    if sys.argv[1:2] == ["deb"] and len(arguments) == 2:
        of_deb(*arguments)
    elif sys.argv[1:2] == ["image"] and len(arguments) > 4:
        of_image(*arguments[:4], arguments[4:])
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main()
