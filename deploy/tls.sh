#!/bin/sh
# Certificates for a Dask scheduler, its workers and its users, and the Dask configuration that names them:
#   sh deploy/tls.sh FOLDER HOST…     (HOST: names or addresses under which the scheduler is reached)
# Copy FOLDER to all machines under the same path, readable by the users of the cluster only, and let everybody (scheduler, workers, cityflow) have
#   export DASK_CONFIG=FOLDER/dask-tls.yaml
# Whoever has client.pem can run code on the workers; whoever has not cannot even connect.
set -eu
folder=${1:?usage: tls.sh FOLDER HOST…}
shift
[ $# -gt 0 ] || { echo "usage: tls.sh FOLDER HOST… (names or addresses of the scheduler)" >&2; exit 1; }
days=${DAYS:-365}
umask 077
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
names=""
for host in "$@"; do
    case $host in
        *[!0-9.]*) kind=DNS ;;
        *) kind=IP ;;
    esac
    names="$names${names:+,}$kind:$host"
done

new_key() { openssl ecparam -name prime256v1 -genkey -noout -out "$1" 2>/dev/null; }

new_key "$folder/ca-key.pem"
openssl req -x509 -new -key "$folder/ca-key.pem" -days "$days" -subj "/CN=cityflow cluster" -out "$folder/ca.pem" \
    -addext "basicConstraints=critical,CA:TRUE" -addext "keyUsage=critical,keyCertSign,cRLSign" 2>/dev/null
for who in scheduler worker client; do
    new_key "$folder/$who-key.pem"
    openssl req -new -key "$folder/$who-key.pem" -subj "/CN=cityflow $who" -out "$folder/$who.csr" 2>/dev/null
    printf 'subjectAltName=%s\nextendedKeyUsage=serverAuth,clientAuth\n' "$names" >"$folder/$who.ext"
    openssl x509 -req -in "$folder/$who.csr" -CA "$folder/ca.pem" -CAkey "$folder/ca-key.pem" -CAcreateserial -days "$days" \
        -extfile "$folder/$who.ext" -out "$folder/$who.pem" 2>/dev/null
    rm -f "$folder/$who.csr" "$folder/$who.ext"
done
cat >"$folder/dask-tls.yaml" <<YAML
distributed:
  comm:
    default-scheme: tls
    require-encryption: true
    tls:
      ca-file: $folder/ca.pem
      scheduler: {cert: $folder/scheduler.pem, key: $folder/scheduler-key.pem}
      worker: {cert: $folder/worker.pem, key: $folder/worker-key.pem}
      client: {cert: $folder/client.pem, key: $folder/client-key.pem}
YAML
echo "export DASK_CONFIG=$folder/dask-tls.yaml"
echo "Keep $folder/ca-key.pem apart: it makes further certificates, and no process needs it."
