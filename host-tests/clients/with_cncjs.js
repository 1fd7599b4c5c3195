// cncjs, headless, streams, holds, resumes, jogs, cancels and resets: driven through its
// socket.io interface, as its page in a browser does it.
'use strict';

const { execFile, spawn } = require('child_process');
const fs = require('fs');
const http = require('http');
const path = require('path');
const { promisify } = require('util');
const io = require('socket.io-client');

const FEED = 600;
const LONG = ['G90', `G1 X300 Y0 F${FEED}`, 'G1 X300 Y30', 'G1 X250 Y0'];
const port = process.env.CONTROLLER;
let failures = 0;

function program(length) {
  const step = length / 499;
  const there = Array.from({ length: 500 }, (_, n) => `G1 X${(250 + step * n).toFixed(3)} F${FEED}`);
  return ['G90', 'G0 X250 Y0', ...there, ...there.slice().reverse().slice(0, 498)];
}

function check(name, holds, detail) {
  if (holds) {
    console.log(`ok ${name}`);
  } else {
    failures += 1;
    console.log(`FAILED ${name}: ${JSON.stringify(detail)}`);
  }
}

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

async function waitFor(condition, seconds = 20) {
  for (const end = Date.now() + 1000 * seconds; Date.now() < end; await sleep(20)) {
    if (await condition()) {
      return true;
    }
  }
  return false;
}

// What the controller says of itself, and what it sends to the drives.
async function observe() {
  const { tcp, telemetry } = JSON.parse(fs.readFileSync(process.env.PORTS));
  const address = (number) => `tcp:127.0.0.1:${number}`;
  const { stdout } = await promisify(execFile)(process.env.STILLPOINT, [
    'monitor', address(tcp), '--once', '--json', '--telemetry', address(telemetry),
  ]);
  const { state, machine, setpoints } = JSON.parse(stdout);
  return { state, machine, sent: [setpoints.x_mm, setpoints.y_mm, setpoints.z_mm] };
}

const near = (one, other) => one.every((value, axis) => Math.abs(value - other[axis]) <= 0.0011);

// The port that cncjs listens on, on this machine alone: one that was free a moment ago.
async function freePort() {
  const server = http.createServer();
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  const { port } = server.address();
  await new Promise((resolve) => server.close(resolve));
  return port;
}

async function post(url, body) {
  const headers = { 'Content-Type': 'application/json' };
  const answer = await fetch(url, { method: 'POST', headers, body: JSON.stringify(body) });
  return answer.json();
}

async function main() {
  const number = await freePort();
  const url = `http://127.0.0.1:${number}`;
  const cli = path.join(process.env.NODE_PATH, 'cncjs', 'bin', 'cncjs');
  const server = spawn(process.execPath, [
    cli, '-H', '127.0.0.1', '-p', String(number), '-c', path.join(process.env.HOME, 'cncrc'),
    '--controller', 'Grbl',
  ], { stdio: 'ignore' });
  process.on('exit', () => server.kill());

  let token;
  const started = await waitFor(async () => {
    token = (await post(`${url}/api/signin`, {}).catch(() => ({}))).token;
    return token !== undefined;
  }, 30);
  check('the server starts', started);

  const socket = io(url, { query: `token=${token}`, transports: ['websocket'] });
  let status = {};
  let sender = {};
  let workflow = '';
  const heard = [];
  socket.on('Grbl:state', (state) => {
    status = state.status;
  });
  socket.on('sender:status', (now) => {
    sender = now;
  });
  socket.on('workflow:state', (state) => {
    workflow = state;
  });
  socket.on('serialport:read', (line) => heard.push(line));
  const command = (...args) => socket.emit('command', port, ...args);
  const position = () => ['x', 'y', 'z'].map((axis) => Number(status.mpos[axis]));
  // Programs and jogs are waited for by the position: a busy machine is late.
  const isUnderWay = () => waitFor(() => status.activeState === 'Run' && position()[0] > 257);
  const isIn = (state, seconds) => waitFor(() => status.activeState === state, seconds);

  async function checkView(name, expected) {
    await sleep(600);
    const { state, machine, sent } = await observe();
    const here = position();
    const same = status.activeState === state.split(':')[0];
    const right = near(here, machine) && near(here, sent) && (!expected || near(here, expected));
    check(`${name}: its view is right`, same && right, { status, state, machine, sent, expected });
  }

  async function stream(name, lines) {
    command('gcode:load', name, lines.join('\n'));
    await waitFor(() => sender.name === name, 5);
    command('gcode:start');
    await waitFor(() => workflow === 'running', 5);
  }

  await new Promise((resolve) => socket.on('startup', resolve));
  const refused = await new Promise((resolve) => {
    socket.emit('open', port, { controllerType: 'Grbl', baudrate: 115200 }, resolve);
  });
  // It waits for the banner, which a board says when a connection resets it.
  command('reset');
  check('connect', !refused && await waitFor(() => heard.some((line) => line.startsWith('Grbl'))), refused);
  check('it knows where it is', await isIn('Idle', 10), status);

  const lines = program(20);
  await stream('thousand', lines);
  const finished = await waitFor(() => workflow === 'idle', 60);
  // It adds a line of its own, on which it waits for the end of the motion.
  const all = sender.total === 1001 && sender.received === 1001;
  check('stream 1000 lines', finished && all && lines.length === 1000, sender);
  await isIn('Idle');
  await checkView('after the program', [250.08, 0, 0]);

  await stream('long', LONG);
  await isUnderWay();
  command('gcode:pause');
  const held = await waitFor(async () => status.activeState === 'Hold' && (await observe()).state === 'Hold:0');
  check('hold', held, status);
  await sleep(500);
  const before = position();
  await sleep(500);
  check('hold: it stands', near(before, position()) && before[0] > 251, [before, position()]);
  await checkView('in the hold');
  command('gcode:resume');
  check('resume', await waitFor(() => workflow === 'idle', 60), workflow);
  await isIn('Idle');
  await checkView('after the resume', [250, 0, 0]);

  command('gcode', '$J=G91 X5 F600');
  check('jog: it sees it', await isIn('Jog', 3), status);
  await isIn('Idle');
  await checkView('after the jog', [255, 0, 0]);
  command('gcode', '$J=G91 X40 F600');
  await waitFor(() => position()[0] > 257);
  command('jogCancel');
  check('jog cancel', await isIn('Idle', 5), status);
  await sleep(500);
  check('jog cancel: it ends on its way', position()[0] > 256 && position()[0] < 294, position());
  await checkView('after the jog cancel');

  await stream('long', LONG);
  await isUnderWay();
  heard.length = 0;
  command('reset');
  check('reset in motion', await waitFor(() => heard.some((line) => line.startsWith('ALARM:3'))), heard);
  check('reset in motion: it sees it', await isIn('Alarm', 3), status);
  await checkView('after the reset');
  command('unlock');
  check('unlock', await isIn('Idle', 3), status);
  heard.length = 0;
  command('reset');
  check('reset at rest', await waitFor(() => heard.some((line) => line.startsWith('Grbl'))), heard);
  await isIn('Idle');
  await checkView('at the end');
  const errors = heard.filter((line) => line.startsWith('error:'));
  check('no line was refused', errors.length === 0, errors);
  await new Promise((resolve) => socket.emit('close', port, resolve));
  socket.close();
}

main()
  .catch((error) => check('the script', false, String(error.stack)))
  .finally(() => process.exit(failures > 0 ? 1 : 0));
